#include "apps/view/window/keys.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

#include "apps/view/tools/hand_pointer.h"
#include "apps/view/tools/tool.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

// A key that was pressed.
struct KeyPress {
    Outcome& next;
    const Event& event;
    const Subject& subject;
    ViewState& state;

    bool is(const char* key) const { return event.key == key; }
    bool shift() const { return event.modifiers.shift; }
    void order(Order order) const { next.orders.push_back(std::move(order)); }
};

struct KeyLine {
    const char *keys, *purpose; // of the help
    struct Use {
        std::string_view keys; // apart by spaces
        void (*use)(const KeyPress&);
        bool with_ctrl = false;
    };
    std::vector<Use> uses{}; // none: what the line tells is done elsewhere
};

void choose_window(const KeyPress& press) {
    const auto number = static_cast<size_t>(press.event.key[0] - '1');
    if (!press.shift() && number < press.subject.windows.size())
        press.state.window = press.subject.windows[number];
}

// The volume seen along one of the patient's axes, at the distance it has now.
void look(ViewState& state, const char* from) {
    const ViewDirection view = view_direction(from).value();
    const double distance = glm::distance(state.camera.eye_mm, state.camera.target_mm);
    state.camera.eye_mm = state.camera.target_mm + distance * glm::normalize(view.towards);
    state.camera.up = view.up;
}

void page_by_key(const KeyPress& press) {
    const std::optional<Panel> under = press.state.under;
    if (under && is_slice(*under))
        page(press.state, press.subject.grid, *under, press.is("up") ? 1.0 : -1.0);
}

void reset(const KeyPress& press) {
    const ViewState& home = press.subject.home;
    press.state.slices = home.slices;
    press.state.camera = home.camera;
    press.state.crosshair_mm = home.crosshair_mm;
    press.state.window = home.window;
}

void fade_labels(const KeyPress& press) {
    double& opacity = press.state.label_opacity;
    const double by = press.is("d") ? 0.1 : -0.1;
    opacity = std::clamp(std::round((opacity + by) * 10) / 10, 0.0, 1.0);
}

void resize_tool(const KeyPress& press) {
    constexpr double kStep = 1.25;
    double& radius_mm = press.state.radius_mm;
    radius_mm =
        press.is("-") ? std::max(radius_mm / kStep, 0.1) : std::min(radius_mm * kStep, 100.0);
}

// One layer of samples thicker or thinner, along the axis on which they lie nearest; at most 100.
void step_slab(const KeyPress& press) {
    const double layer = smallest_spacing_mm(press.subject.grid);
    const double layers = std::round(press.state.slab_mm / layer) + (press.is("]") ? 1.0 : -1.0);
    press.state.slab_mm = layer * std::clamp(layers, 0.0, 100.0);
}

// The next of the values of an enum, the first one after the last.
template <class Choice>
void go_on(Choice& choice, size_t count) {
    choice = static_cast<Choice>((static_cast<size_t>(choice) + 1) % count);
}

void start_or_stop_hand(const KeyPress& press) {
    if (!press.state.stylus.on)
        begin_hand(press.state, press.subject);
    press.order(press.state.stylus.on ? Order(order::StopHand{}) : order::StartHand{});
}

void undo_or_redo(const KeyPress& press) {
    press.order(press.is("y") || press.shift() ? Order(order::Redo{}) : order::Undo{});
}

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
    {"+ -", "size of the tool", {{"+ = -", resize_tool}}},
    {"Ctrl+Z, Ctrl+Y", "undo, redo", {{"z y", undo_or_redo, true}}},
    {"Ctrl+O, Ctrl+S",
     "open a file, a folder or a project; save to a project folder",
     {{"o",
       [](const KeyPress& p) {
           p.state.browser_open = true;
           p.state.browsing = Browsing::documents;
       },
       true},
      {"s", [](const KeyPress& p) { p.order(order::Save{}); }, true}}},
    {"Ctrl+P",
     "picture of the window, PNG, in the current folder",
     {{"p", [](const KeyPress& p) { p.order(order::TakePicture{}); }, true}}},
    {"Esc", "cancel the stroke; close an open list"},
    {"1 .. 9", "windows", {{"1 2 3 4 5 6 7 8 9", choose_window}}},
    {"S, A, D",
     "labels: show, fade, strengthen",
     {{"s", [](const KeyPress& p) { p.state.labels_shown = !p.state.labels_shown; }},
      {"a d", fade_labels}}},
    {"Up, Down", "next and previous slice under the pointer", {{"up down", page_by_key}}},
    {"Home, End, Page Down",
     "3D from above, front, left; Shift: from the other side",
     {{"home", [](const KeyPress& p) { look(p.state, p.shift() ? "bottom" : "top"); }},
      {"end", [](const KeyPress& p) { look(p.state, p.shift() ? "back" : "front"); }},
      {"page_down", [](const KeyPress& p) { look(p.state, p.shift() ? "right" : "left"); }}}},
    {"L, Tab",
     "layout; which slice is shown alone",
     {{"l",
       [](const KeyPress& p) {
           p.state.alone.reset();
           go_on(p.state.layout, 3);
       }},
      {"tab", [](const KeyPress& p) { go_on(p.state.slice, kSlicePanels); }}}},
    {"[ ], \\",
     "thinner and thicker slices; maximum, minimum, mean",
     {{"[ ]", step_slab}, {"\\", [](const KeyPress& p) { go_on(p.state.slab_mode, 3); }}}},
    {"G, V",
     "3D: in stereo, and back; by rays, by the surface, or both",
     {{"g",
       [](const KeyPress& p) {
           p.state.stereo.on = !p.state.stereo.on;
           move_cursor(p.state, p.subject);
       }},
      {"v", [](const KeyPress& p) { go_on(p.state.seen_as, std::size(kSeenAs)); }}}},
    {"P, H, N, T",
     "show or hide: slices in 3D, crosshair, notes, tools",
     {{"p", [](const KeyPress& p) { p.state.slices_in_volume = !p.state.slices_in_volume; }},
      {"h", [](const KeyPress& p) { p.state.crosshair_shown = !p.state.crosshair_shown; }},
      {"n", [](const KeyPress& p) { p.state.notes_shown = !p.state.notes_shown; }},
      {"t", [](const KeyPress& p) { p.state.tools_open = !p.state.tools_open; }}}},
    {"R", "reset views and window", {{"r", reset}}},
    {"Y, O, Space, Esc",
     "touch: its window, start or stop the hand, arm, disarm",
     {{"y", [](const KeyPress& p) { p.state.touch_open = !p.state.touch_open; }},
      {"o", start_or_stop_hand},
      {"space",
       [](const KeyPress& p) {
           if (p.state.stylus.on)
               p.order(order::ArmHand{});
       }}}},
    {"K, J, I",
     "touch: shape of the tool, force as an arrow, widgets in 3D",
     {{"k", [](const KeyPress& p) { go_on(p.state.stylus.shape, std::size(kTipShapes)); }},
      {"j", [](const KeyPress& p) { p.state.stylus.arrow_shown = !p.state.stylus.arrow_shown; }},
      {"i", [](const KeyPress& p) { p.state.palette_shown = !p.state.palette_shown; }}}},
    {"mouse as a hand", "left, right: its buttons; in 3D wheel up: deeper; middle: rotate"},
    {"?",
     "all keys",
     {{"/", [](const KeyPress& p) { p.state.help_open = p.state.help_open != p.shift(); }}}},
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
             !std::exchange(state.browser_open, false) &&
             !std::exchange(state.series_open, false) &&
             !std::exchange(state.leaving, std::nullopt) &&
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
    if (event.down && state.saving_open && !state.drag)
        return use_saving_key(press);
    if (!event.down || event.for_widget)
        return;
    if (press.is("escape"))
        return escape(press);
    // No key counts while a question is open, or while a button is pressed and a tool is at work.
    if (state.leaving || state.drag)
        return;
    if (!event.modifiers.ctrl) {
        for (const Tool* tool : tools())
            if (tool->use_key && tool->use_key(next, event, subject))
                return;
        if (take_tool(state, event.key))
            return;
    }
    if (!use_line(kKeys, press))
        use_line(kButtons, press);
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
