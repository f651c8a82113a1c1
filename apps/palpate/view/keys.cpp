#include "apps/palpate/view/event.h"
#include "apps/palpate/view/interaction.h"

namespace palpate::view {

const std::vector<std::string>& key_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all{
            "escape", "enter", "tab",     "backspace", "insert", "delete", "right", "left",
            "down",   "up",    "page_up", "page_down", "home",   "end",    "space", "'",
            ",",      "-",     ".",       "/",         ";",      "=",      "[",     "\\",
            "]",      "`",     "+",       "shift",     "ctrl",   "alt"};
        for (char letter = 'a'; letter <= 'z'; ++letter)
            all.emplace_back(1, letter);
        for (char digit = '0'; digit <= '9'; ++digit)
            all.emplace_back(1, digit);
        return all;
    }();
    return names;
}

const std::vector<KeyHelp>& key_help() {
    static const std::vector<KeyHelp> help{
        {"left", "slices: the tool; 3D: rotate (Shift: pan, Ctrl: roll)"},
        {"middle", "pan"},
        {"right", "zoom"},
        {"wheel", "slices: next slice (Ctrl: zoom); 3D: zoom"},
        {"W + left", "window: across is width, up and down is level"},
        {"Shift + move", "crosshair everywhere, in 3D on what is seen"},
        {"drag a handle", "turn a plane; R turns it back"},
        {"double click, F", "maximise a view, and back"},
        {"C B E X", "tool: crosshair, brush, eraser, cut"},
        {"Q", "seeds for a segmentation"},
        {"U", "live-wire: a contour along edges; click: freeze, Enter, double click: fill"},
        {"M", "measure: ruler, angle, polygon, sphere; Delete removes"},
        {"+ -", "size of the tool"},
        {"Ctrl+Z, Ctrl+Y", "undo, redo"},
        {"Ctrl+O", "open a file, a folder or a project"},
        {"Ctrl+S", "save to a project folder"},
        {"Ctrl+P", "picture of the window, PNG, in the current folder"},
        {"Esc", "cancel the stroke; close an open list"},
        {"1 .. 9", "windows"},
        {"S, A, D", "labels: show, fade, strengthen"},
        {"Up, Down", "next and previous slice under the pointer"},
        {"Home, End, Page Down", "3D from above, front, left; Shift: from the other side"},
        {"L, Tab", "layout; which slice is shown alone"},
        {"[ ], \\", "thinner and thicker slices; maximum, minimum, mean"},
        {"G", "stereo in 3D, and back"},
        {"V", "3D by rays, by the surface, or both"},
        {"P, H, N, T", "show or hide: slices in 3D, crosshair, notes, tools"},
        {"R", "reset views and window"},
        {"Y, O, Space, Esc", "touch: its window, start or stop the hand, arm, disarm"},
        {"K, J, I", "touch: shape of the tool, force as an arrow, widgets in 3D"},
        {"mouse as a hand", "left, right: its buttons; in 3D wheel up: deeper; middle: rotate"},
        {"?", "this list"},
    };
    return help;
}

} // namespace palpate::view
