#include "apps/palpate/view/key_presses.h"

#include <algorithm>
#include <cmath>

#include "apps/palpate/view/hand_pointer.h"
#include "apps/palpate/view/tools/tool.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

// The volume seen along one of the patient's axes, at the distance it has now.
void look(ViewState& state, const char* from) {
    const ViewDirection view = view_direction(from).value();
    const double distance = glm::distance(state.camera.eye_mm, state.camera.target_mm);
    state.camera.eye_mm = state.camera.target_mm + distance * glm::normalize(view.towards);
    state.camera.up = view.up;
}

void reset(ViewState& state, const Subject& subject) {
    state.slices = subject.home.slices;
    state.camera = subject.home.camera;
    state.crosshair_mm = subject.home.crosshair_mm;
    state.window = subject.home.window;
}

// One layer of samples thicker or thinner, along the axis on which they lie nearest; at most 100.
void step_slab(ViewState& state, const Grid& grid, bool thicker) {
    const double layer = smallest_spacing_mm(grid);
    const double layers = std::round(state.slab_mm / layer) + (thicker ? 1.0 : -1.0);
    state.slab_mm = layer * std::clamp(layers, 0.0, 100.0);
}

// Keys without Ctrl.
void press_key(ViewState& state, const std::string& key, bool shift, const Subject& subject) {
    constexpr double kSizeStep = 1.25;
    const auto fade = [&](double by) {
        state.label_opacity =
            std::clamp(std::round((state.label_opacity + by) * 10) / 10, 0.0, 1.0);
    };
    if (key.size() == 1 && key[0] >= '1' && key[0] <= '9') {
        const size_t number = static_cast<size_t>(key[0] - '1');
        if (!shift && number < subject.windows.size())
            state.window = subject.windows[number];
    } else if (key == "home") {
        look(state, shift ? "bottom" : "top");
    } else if (key == "end") {
        look(state, shift ? "back" : "front");
    } else if (key == "page_down") {
        look(state, shift ? "right" : "left");
    } else if (key == "up" || key == "down") {
        if (state.under && is_slice(*state.under))
            page(state, subject.grid, *state.under, key == "up" ? 1.0 : -1.0);
    } else if (key == "r") {
        reset(state, subject);
    } else if (key == "s") {
        state.labels_shown = !state.labels_shown;
    } else if (key == "a") {
        fade(-0.1);
    } else if (key == "d") {
        fade(0.1);
    } else if (key == "=" || key == "+") {
        state.radius_mm = std::min(state.radius_mm * kSizeStep, 100.0);
    } else if (key == "-") {
        state.radius_mm = std::max(state.radius_mm / kSizeStep, 0.1);
    } else if (key == "f") {
        state.alone = state.alone ? std::nullopt : state.under;
    } else if (key == "l") {
        state.alone.reset();
        state.layout = static_cast<Layout>((static_cast<int>(state.layout) + 1) % 3);
    } else if (key == "tab") {
        state.slice = static_cast<Panel>((static_cast<int>(state.slice) + 1) % 3);
    } else if (key == "t") {
        state.tools_open = !state.tools_open;
    } else if (key == "n") {
        state.notes_shown = !state.notes_shown;
    } else if (key == "h") {
        state.crosshair_shown = !state.crosshair_shown;
    } else if (key == "g") {
        state.stereo.on = !state.stereo.on;
        move_cursor(state, subject);
    } else if (key == "[" || key == "]") {
        step_slab(state, subject.grid, key == "]");
    } else if (key == "\\") {
        state.slab_mode = static_cast<SlabMode>((static_cast<int>(state.slab_mode) + 1) % 3);
    } else if (key == "y") {
        state.touch_open = !state.touch_open;
    } else if (key == "v") {
        state.seen_as =
            static_cast<SeenAs>((static_cast<size_t>(state.seen_as) + 1) % std::size(kSeenAs));
    } else if (key == "i") {
        state.palette_shown = !state.palette_shown;
    } else if (key == "k") {
        state.stylus.shape = static_cast<TipShape>((static_cast<size_t>(state.stylus.shape) + 1) %
                                                   std::size(kTipShapes));
    } else if (key == "j") {
        state.stylus.arrow_shown = !state.stylus.arrow_shown;
    } else if (key == "p") {
        state.slices_in_volume = !state.slices_in_volume;
    } else if (key == "/" && shift) {
        state.help_open = !state.help_open;
    }
}

} // namespace

void page(ViewState& state, const Grid& grid, Panel panel, double layers) {
    const glm::dvec3 away = -state.slices[static_cast<size_t>(panel)].towards;
    move_crosshair(state, grid, state.crosshair_mm + layers * layer_step_mm(grid, away) * away);
}

// The first tool that has begun something drops it. False: none has.
static bool cancel_tools(ViewState& state) {
    return std::any_of(tools().begin(), tools().end(),
                       [&](const Tool* tool) { return tool->cancel && tool->cancel(state); });
}

// While it is asked where to save. Escape and Ctrl+S count whichever text field has the keys.
static void press_saving_key(Outcome& next, const Event& event) {
    if (event.key == "escape")
        next.state.saving_open = false;
    else if (event.key == "s" && event.modifiers.ctrl)
        next.orders.push_back({Order::Kind::save, {}, event.time_s, {}});
    else if (event.key == "enter" && !event.for_widget)
        next.state.saving_entered = true;
}

void use_key(Outcome& next, const Event& event, const Subject& subject) {
    ViewState& state = next.state;
    if (event.key == "w")
        state.w_held = event.down && !event.for_widget && !state.saving_open;
    const auto order = [&](Order::Kind kind) {
        next.orders.push_back({kind, {}, event.time_s, {}});
    };
    if (event.down && event.key == "escape" && state.stylus.on) // also while text is typed
        order(Order::Kind::hand_disarm);
    if (event.down && state.saving_open && !state.drag)
        return press_saving_key(next, event);
    if (!event.down || event.for_widget)
        return;
    if (event.key == "escape") {
        if (state.drag && state.drag->kind == Drag::Kind::tool && state.drag->tool->abort)
            state.drag->tool->abort({next, event, subject, state.drag->panel});
        else if (!state.drag && !std::exchange(state.help_open, false) && !cancel_tools(state) &&
                 !std::exchange(state.browser_open, false) &&
                 !std::exchange(state.series_open, false) &&
                 !std::exchange(state.leaving, std::nullopt) &&
                 !std::exchange(state.recovered_steps, 0))
            state.alone.reset();
        state.drag.reset();
        state.clipping.held.reset();
        return;
    }
    if (state.leaving) // a question
        return;
    if (state.drag) // nothing is moved by accident while a hand is at work
        return;
    if (event.key == "o" && !event.modifiers.ctrl) {
        if (!state.stylus.on)
            begin_hand(state, subject);
        return order(state.stylus.on ? Order::Kind::hand_stop : Order::Kind::hand_start);
    }
    if (event.key == "space" && state.stylus.on)
        return order(Order::Kind::hand_arm);
    if (!event.modifiers.ctrl) {
        const bool is_taken = std::any_of(tools().begin(), tools().end(), [&](const Tool* tool) {
            return tool->use_key && tool->use_key(next, event, subject);
        });
        if (!is_taken && !take_tool(state, event.key))
            press_key(state, event.key, event.modifiers.shift, subject);
        return;
    }
    if (event.key == "o") {
        state.browser_open = true;
        state.browsing = Browsing::documents;
        return;
    }
    if (event.key == "p")
        return order(Order::Kind::picture);
    if (event.key == "s") {
        next.orders.push_back({Order::Kind::save, {}, event.time_s, {}});
        return;
    }
    const bool redo = event.key == "y" || (event.key == "z" && event.modifiers.shift);
    if (redo || event.key == "z")
        next.orders.push_back({redo ? Order::Kind::redo : Order::Kind::undo, {}, event.time_s, {}});
}

} // namespace palpate::view
