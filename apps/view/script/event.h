#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace palpate::view {

enum class Button { left, middle, right };

struct Modifiers {
    bool shift = false, ctrl = false, alt = false;

    friend bool operator==(const Modifiers&, const Modifiers&) = default;
};

// One input of a person to the window. A value: it can be written to a script and done again.
struct Event {
    enum class Kind { move, button, wheel, key, text, resize, drop, close };
    Kind kind = Kind::move;
    double time_s = 0; // since the window opened; never falls
    Modifiers modifiers{};
    glm::dvec2 at_px{0.0}; // move: the pointer; (x, y) lies on pixel (x, y), row 0 at the top
    Button button = Button::left;
    bool down = false;                // button, key: pressed, or released
    glm::dvec2 wheel{0.0};            // in notches; y > 0 turns away from the hand
    std::string key{};                // "a", "7", "home", "page_down"; see key_names()
    std::string text{};               // what was typed, UTF-8
    glm::uvec2 size_px{0};            // resize: of the window
    std::vector<std::string> paths{}; // drop
    // Whether a widget of the interface, and not a view, takes it. Made anew when a script is done.
    bool for_widget = false;

    friend bool operator==(const Event&, const Event&) = default;
};

// Names of keys in events, scripts and messages: letters and digits as they are, in lower case.
const std::vector<std::string>& key_names();

} // namespace palpate::view
