#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/view/script/place.h"
#include "engine/base/error.h"
#include "engine/base/json.h"

namespace palpate::view {

// Input of a window, to be done again: JSON lines (docs/reference/view-scripts.md). A header
//
//     {"palpate_view": 2, "size": [1280, 800], "text_scale": 1}
//
// and then one event a line, with the number of the frame that took it and its time:
//
//     {"frame": 3, "t_s": 0.05, "move": {"view": "axial", "mm": [12, -40, 96.5]}}
//     {"frame": 4, "t_s": 0.07, "button": "left", "down": true, "shift": true}
//     {"frame": 5, "t_s": 0.1, "key": "home", "down": true}
//
// also "wheel": [x, y], "text": "a", "resize": [w, h] and "drop": ["file"]. A move names a widget
// or a place in a view (place.h), or pixels: [640, 400]. Version 1 has pixels alone. Frames and
// times never fall. A frame without t_s is at frame / 60 s.
struct Script {
    struct Line {
        uint64_t frame = 0;
        Event event;
        Place place{}; // of a move; none: its pixels

        friend bool operator==(const Line&, const Line&) = default;
    };
    std::string name; // of the file, for messages
    glm::uvec2 size_px{1280, 800};
    double text_scale = 1.0;
    std::vector<Line> lines;
};

constexpr double kFrame_s = 1.0 / 60.0;

// An error names the file, the line, what was expected and what was found.
Result<Script> parse_script(const std::string& text, const std::string& name);
Result<Script> load_script(const std::filesystem::path& path);

// Lines as parse_script() reads them, with a line break.
std::string header_line(glm::uvec2 size_px, double text_scale);
std::string event_line(uint64_t frame, const Event& event, const Place& place = {});

// The order in which frames take events: a frame has a run of moves, or one event of another kind,
// so that no press is lost between two frames.
class EventQueue {
 public:
    void push(Event event) { waiting_.push_back(std::move(event)); }
    bool empty() const { return waiting_.empty(); }
    std::vector<Event> take_frame();

 private:
    std::vector<Event> waiting_;
};

} // namespace palpate::view
