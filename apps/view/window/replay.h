#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/view/script/script.h"
#include "apps/view/window/viewer.h"

namespace palpate::view {

// Writes what happens as it happens, so that it is there after a crash. Moves are written as places
// (place.h).
class Recorder {
 public:
    // An empty path: nothing is written.
    Recorder(const std::filesystem::path& path, glm::uvec2 size_px, double text_scale);

    // Events that the viewer is about to take, in the frame of this number.
    void add(uint64_t frame, const std::vector<Event>& events, const Viewer& viewer);
    bool failed() const { return file_.fail(); }
    bool is_open() const { return file_.is_open(); }
    // Ends without the last press of a button and what came after it: that ended the recording.
    void drop_last_press();

 private:
    std::filesystem::path path_;
    std::ofstream file_;
    std::streamoff before_press_ = 0;
    Placing placing_;
};

// A script's events, frame by frame. A move to a widget or view that is not shown leaves the
// pointer where it is; a press or a wheel there is an error, that names the frame and the place.
class ScriptCursor {
 public:
    explicit ScriptCursor(const Script& script) : script_(&script) {}

    bool is_done() const { return next_ == script_->lines.size(); }
    const Script::Line& next() const { return script_->lines[next_]; } // if it is not done
    size_t done() const { return next_; }                              // lines
    // Those of all frames up to this one; places are those that the viewer shows now.
    Result<std::vector<Event>> take(uint64_t frame, const Viewer& viewer);

 private:
    const Script* script_;
    size_t next_ = 0;
    std::string absent_; // the place of the last move, and how it is not there
};

// Frames after which nothing changes without events.
constexpr uint64_t kSettling_frames = 3;

// Does a script's frames, and two after its last event, at the times it tells. Of frames without
// events, in which nothing changes, at most three are done between two events.
Result<void> replay(Viewer& viewer, const Script& script, Recorder* recorder = nullptr);

} // namespace palpate::view
