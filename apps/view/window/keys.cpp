#include "apps/view/window/keys.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "apps/view/tools/clip_tool.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/key_actions.h"

namespace palpate::view {

namespace {

struct KeyLine {
    const char *keys, *purpose; // of the help
    struct Use {
        std::string_view keys; // apart by spaces
        void (*use)(const KeyPress&);
        bool with_ctrl = false;
        // The title of the first key, and with Shift, in the search box; null: nothing that would
        // help there.
        const char *does = nullptr, *shifted = nullptr;
    };
    std::vector<Use> uses{}; // none: what the line tells is done elsewhere
};

const KeyLine kButtons[] = {
    {"left", "slices: the tool; 3D: rotate (Shift: pan, Ctrl: roll)"},
    {"middle, right", "pan, zoom"},
    {"wheel", "slices: next slice (Ctrl: zoom); 3D: zoom"},
    {"W + left", "window: across is width, up and down is level"},
    {"Shift + move", "crosshair everywhere, in 3D on what is seen"},
    {"drag a ring", "of a line: turn a plane; R turns it back"},
    {"double click, F",
     "maximise a view, and back",
     {{"f",
       [](const KeyPress& p) { p.state.alone = p.state.alone ? std::nullopt : p.state.under; }}}},
};

const KeyLine kKeys[] = {
    {"+ -",
     "size of the tool",
     {{"= +", resize_tool, false, "larger brush"}, {"-", resize_tool, false, "smaller brush"}}},
    {"Ctrl+Z, Ctrl+Y",
     "undo, redo",
     {{"z", undo_or_redo, true, "undo", "redo"}, {"y", undo_or_redo, true}}},
    {"Ctrl+O, Ctrl+S",
     "open a file, a folder or a project (Shift: the last one); save to a project folder",
     {{"o",
       [](const KeyPress& p) {
           if (p.shift())
               return p.order(order::OpenLast{});
           p.state.browser_open = true;
           p.state.browsing = Browsing::documents;
       },
       true, "open a file, a folder or a project", "open what was open last"},
      {"s", [](const KeyPress& p) { p.order(order::Save{}); }, true, "save to a project folder"}}},
    {"Ctrl+Q",
     "close the window",
     {{"q", [](const KeyPress& p) { p.order(order::Close{}); }, true, "close the window"}}},
    {"Ctrl+K",
     "find a tool, a command or a setting by its name",
     {{"k", [](const KeyPress& p) { p.state.search_open = true; }, true}}},
    {"Ctrl+P",
     "picture of the window (Shift: figure of the view under the pointer), PNG, in the current "
     "folder",
     {{"p", take_picture, true, "picture of the window", "figure of the view under the pointer"}}},
    {"Ctrl+L",
     "locks the label under the pointer, or opens it again",
     {{"l", lock_label, true, "lock or open the label under the pointer"}}},
    {"Ctrl+T",
     "brush: only values like those under the pointer, and all again",
     {{"t", take_values, true, "only values like those under the pointer"}}},
    {"Ctrl+B",
     "3D: cuts it open by a plane through the crosshair",
     {{"b", [](const KeyPress& p) { add_clip_plane(p.state); }, true, "add a clip plane"}}},
    {"Ctrl+I, Ctrl+U",
     "label: fills it between slices, smooths it",
     {{"i", [](const KeyPress& p) { change_label(p, "between"); }, true},
      {"u", [](const KeyPress& p) { change_label(p, "smooth"); }, true}}},
    {"Ctrl+E",
     "exports all labels (Shift: the surface of the one that is drawn, STL) to the current folder",
     {{"e", export_labels, true, "export all labels", "export the surface of the label"}}},
    {"Esc", "cancel the stroke; close an open list"},
    {"1 .. 9", "windows", {{"1 2 3 4 5 6 7 8 9", choose_window}}},
    {"S, A, D",
     "labels: show, fade, strengthen",
     {{"s", [](const KeyPress& p) { p.state.labels_shown = !p.state.labels_shown; }, false,
       "show or hide labels"},
      {"a", fade_labels, false, "fade labels"},
      {"d", fade_labels, false, "strengthen labels"}}},
    {"Up, Down", "next and previous slice under the pointer", {{"up down", page_by_key}}},
    {"Home, End, Page Down",
     "3D from above, front, left; Shift: from the other side",
     {{"home", [](const KeyPress& p) { look(p.state, p.shift() ? "bottom" : "top"); }, false,
       "3D from above", "3D from below"},
      {"end", [](const KeyPress& p) { look(p.state, p.shift() ? "back" : "front"); }, false,
       "3D from the front", "3D from the back"},
      {"page_down", [](const KeyPress& p) { look(p.state, p.shift() ? "right" : "left"); }, false,
       "3D from the left", "3D from the right"}}},
    {"L, Tab",
     "layout; which slice is shown alone",
     {{"l",
       [](const KeyPress& p) {
           p.state.alone.reset();
           go_on(p.state.layout, 3);
       },
       false, "next layout of views"},
      {"tab", [](const KeyPress& p) { go_on(p.state.slice, kSlicePanels); }}}},
    {"[ ], \\",
     "thinner and thicker slices; maximum, minimum, mean",
     {{"[", step_slab, false, "thinner slices"},
      {"]", step_slab, false, "thicker slices"},
      {"\\", [](const KeyPress& p) { go_on(p.state.slab_mode, 3); }, false,
       "thick slices by maximum, minimum or mean"}}},
    {"G, V",
     "3D: in stereo, and back; by rays, by the surface, or both",
     {{"g",
       [](const KeyPress& p) {
           p.state.stereo.on = !p.state.stereo.on;
           move_cursor(p.state, p.subject);
       },
       false, "3D in stereo, and back"},
      {"v", [](const KeyPress& p) { go_on(p.state.seen_as, std::size(kSeenAs)); }, false,
       "3D by rays, by the surface, or both"}}},
    {"P, H, N, T",
     "show or hide: slices in 3D, crosshair, notes, tools",
     {{"p", [](const KeyPress& p) { p.state.slices_in_volume = !p.state.slices_in_volume; }, false,
       "show or hide slices in 3D"},
      {"h", [](const KeyPress& p) { p.state.crosshair_shown = !p.state.crosshair_shown; }, false,
       "show or hide the crosshair"},
      {"n", [](const KeyPress& p) { p.state.notes_shown = !p.state.notes_shown; }, false,
       "show or hide letters in views"},
      {"t", [](const KeyPress& p) { p.state.tools_open = !p.state.tools_open; }, false,
       "show or hide the panel"}}},
    {"R", "reset views and window", {{"r", reset, false, "reset views and window"}}},
    {"Y, O, Space, Esc",
     "touch: its window, start or stop the hand, arm, disarm",
     {{"y", [](const KeyPress& p) { p.state.touch_open = !p.state.touch_open; }, false,
       "touch: show or hide its window"},
      {"o", start_or_stop_hand, false, "touch: start or stop the hand"},
      {"space",
       [](const KeyPress& p) {
           if (p.state.stylus.on)
               p.order(order::ArmHand{});
       },
       false, "touch: arm the hand"}}},
    {"K, J, I",
     "touch: shape of the tool, force as an arrow, widgets in 3D",
     {{"k", [](const KeyPress& p) { go_on(p.state.stylus.shape, std::size(kTipShapes)); }, false,
       "touch: next shape of the tool"},
      {"j", [](const KeyPress& p) { p.state.stylus.arrow_shown = !p.state.stylus.arrow_shown; },
       false, "touch: force as an arrow"},
      {"i", [](const KeyPress& p) { p.state.palette_shown = !p.state.palette_shown; }, false,
       "touch: widgets in 3D"}}},
    {"mouse as a hand", "left, right: its buttons; in 3D wheel up: deeper; middle: rotate"},
    {"?",
     "all keys",
     {{"/", [](const KeyPress& p) { p.state.help_open = p.state.help_open != p.shift(); }, false,
       nullptr, "all keys"}}},
};

bool has_word(std::string_view words, std::string_view word) {
    for (size_t end; !words.empty(); words.remove_prefix(std::min(words.size(), end + 1))) {
        end = std::min(words.find(' '), words.size());
        if (words.substr(0, end) == word)
            return true;
    }
    return false;
}

// False: the lines have no such key.
template <class Lines>
bool use_line(const Lines& lines, const KeyPress& press) {
    for (const KeyLine& line : lines)
        for (const KeyLine::Use& use : line.uses)
            if (has_word(use.keys, press.event.key) &&
                press.event.modifiers.ctrl == use.with_ctrl) {
                use.use(press);
                return true;
            }
    return false;
}

// The first tool that has begun something drops it. False: none has.
bool cancel_tools(ViewState& state) {
    return std::any_of(tools().begin(), tools().end(),
                       [&](const Tool* tool) { return tool->cancel && tool->cancel(state); });
}

void escape(const KeyPress& press) {
    ViewState& state = press.state;
    if (state.drag && state.drag->kind == Drag::Kind::tool && state.drag->tool->abort)
        state.drag->tool->abort({press.next, press.event, press.subject, state.drag->panel});
    else if (!state.drag && !std::exchange(state.help_open, false) && !cancel_tools(state) &&
             !std::exchange(state.search_open, false) &&
             !std::exchange(state.browser_open, false) &&
             !std::exchange(state.series_open, false) &&
             !std::exchange(state.welcome_open, false) &&
             !std::exchange(state.leaving, std::nullopt) &&
             !std::exchange(state.file_question, std::nullopt) &&
             !std::exchange(state.recovered_steps, 0))
        state.alone.reset();
    state.drag.reset();
    state.clipping.held.reset();
}

// While it is asked where to save. Escape and Ctrl+S count whichever text field has the keys.
void use_saving_key(const KeyPress& press) {
    if (press.is("escape"))
        press.state.saving_open = false;
    else if (press.is("s") && press.event.modifiers.ctrl)
        press.order(order::Save{});
    else if (press.is("enter") && !press.event.for_widget)
        press.state.saving_entered = true;
}

} // namespace

void use_key(Outcome& next, const Event& event, const Subject& subject) {
    ViewState& state = next.state;
    const KeyPress press{next, event, subject, state};
    if (press.is("w"))
        state.w_held = event.down && !event.for_widget && !state.saving_open;
    if (event.down && press.is("escape") && state.stylus.on) // also while text is typed
        press.order(order::DisarmHand{});
    if (event.down && state.saving_open && !state.browser_open && !state.drag)
        return use_saving_key(press);
    if (!event.down || event.for_widget)
        return;
    if (press.is("escape"))
        return escape(press);
    if (state.drag)
        return; // a button is pressed, and a tool is at work
    const auto tell = [&](const std::string& why) {
        if (!why.empty())
            press.order(order::Tell{why});
    };
    // No key counts while a question or a chooser is open.
    if (state.leaving || state.file_question || state.browser_open || state.series_open)
        return tell(why_idle(press, true));
    if (!event.modifiers.ctrl) {
        for (const Tool* tool : tools())
            if (tool->use_key && tool->use_key(next, event, subject))
                return;
        if (take_tool(state, event.key))
            return;
    }
    const std::string why = why_idle(press, true); // before the key has changed anything
    const bool is_known = use_line(kKeys, press) || use_line(kButtons, press);
    tell(is_known ? why : why_idle(press, false));
}

std::vector<KeyCommand> key_commands() {
    std::vector<KeyCommand> all;
    const auto add = [&](const KeyLine::Use& use, const char* does, bool shift) {
        Event press{.kind = Event::Kind::key, .down = true};
        press.key = std::string(use.keys.substr(0, use.keys.find(' ')));
        press.modifiers.shift = shift;
        press.modifiers.ctrl = use.with_ctrl;
        std::string keys = press.key;
        if (keys.size() == 1) // else a name: "page_down"
            keys[0] = static_cast<char>(std::toupper(keys[0]));
        std::replace(keys.begin(), keys.end(), '_', ' ');
        all.push_back(
            {does, fmt::format("{}{}{}", use.with_ctrl ? "Ctrl+" : "", shift ? "Shift+" : "", keys),
             press});
    };
    for (const KeyLine& line : kKeys)
        for (const KeyLine::Use& use : line.uses) {
            if (use.does)
                add(use, use.does, false);
            if (use.shifted)
                add(use, use.shifted, true);
        }
    return all;
}

const std::vector<KeyHelp>& key_help() {
    static const std::vector<KeyHelp> help = [] {
        std::vector<KeyHelp> all;
        for (const KeyLine& line : kButtons)
            all.push_back({line.keys, line.purpose});
        for (const Tool* tool : tools())
            if (tool->key)
                all.push_back({key_of(*tool), fmt::format("{}: {}", tool->title, tool->help)});
        for (const KeyLine& line : kKeys)
            all.push_back({line.keys, line.purpose});
        return all;
    }();
    return help;
}

} // namespace palpate::view
