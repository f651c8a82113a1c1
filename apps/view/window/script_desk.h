#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/view/window/replay.h"

namespace palpate::view {

// Input of a window on its way to the viewer: it is recorded, and while a script is played that
// takes its place. A press, a key or a turn of the wheel ends the script: what it held is let go,
// and the window is the person's again.
class ScriptDesk {
 public:
    // record: a script that is written from the beginning; empty: none.
    ScriptDesk(const std::filesystem::path& record, glm::uvec2 size_px, double text_scale);

    // Plays from the next frame on. speed > 0: times as fast as it was recorded; infinite: as fast
    // as frames come.
    void play(Script script, double speed);

    // The events of the next frame, of what a person does and the time since the window opened;
    // with the viewer's orders to record, to play and to stop, which it is told the state of.
    std::vector<Event> take(uint64_t frame, std::vector<Event> person, double window_s,
                            Viewer& viewer);
    double time_s() const { return time_s_; } // the viewer's, of that frame; never falls

    bool is_playing() const { return playing_ != nullptr; }
    bool failed() const { return recorder_.failed(); } // the recording from the beginning

 private:
    struct Playing {
        Script script;
        double speed;
        ScriptCursor cursor{script};
        double began_s = 0.0;                // the viewer's time
        double window_s = 0.0;               // the window's, at that time
        uint64_t frames_to_wait = 0;         // until widgets have answered
        std::set<Button> buttons{};          // that it holds
        std::map<std::string, Event> keys{}; // that it holds, as they were pressed
    };
    void obey(Viewer& viewer);
    std::vector<Event> play_on(double window_s, Viewer& viewer);
    void let_go(); // of what is played
    void stop(const std::string& why, Viewer& viewer);

    Recorder recorder_;           // of the command line
    std::optional<Recorder> own_; // that a person has begun in the window
    std::string own_path_;
    std::unique_ptr<Playing> playing_;
    EventQueue waiting_; // before what a person does
    double time_s_ = 0.0, shift_s_ = 0.0;
};

} // namespace palpate::view
