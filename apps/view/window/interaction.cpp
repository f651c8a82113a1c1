#include "apps/view/window/interaction.h"

#include <algorithm>
#include <cmath>

#include "apps/view/tools/clip_tool.h"
#include "apps/view/tools/hand_pointer.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/camera_moves.h"
#include "apps/view/window/keys.h"

namespace palpate::view {

namespace {

constexpr double kDoubleClick_s = 0.35, kDoubleClick_px = 5.0;
constexpr double kZoomPerPx = 1.01;          // of a drag
constexpr double kZoomPerNotch = 1.15;       // of the wheel
constexpr double kWindowPerPx = 1.0 / 250.0; // of its width

// The zoom changes and what is under a pixel stays there.
void zoom_slice(ViewState& state, const Grid& grid, Panel panel, double times, glm::dvec2 at_px) {
    SliceView& slice = state.slices[static_cast<size_t>(panel)];
    const glm::dvec3 before = point_under(state, grid, panel, at_px);
    slice.zoom = std::clamp(slice.zoom * times, 0.05, 200.0);
    slice.center_mm += before - point_under(state, grid, panel, at_px);
}

// Left and right change the width, up and down the level.
void drag_window(ViewState& state, const Subject& subject, glm::dvec2 by_px) {
    const double width = state.window.high - state.window.low;
    const double level =
        0.5 * (state.window.low + state.window.high) - by_px.y * kWindowPerPx * width;
    const double next = width * std::exp(by_px.x * kWindowPerPx);
    state.window = limited({level - 0.5 * next, level + 0.5 * next}, subject.range);
}

void press(Outcome& next, const Event& event, const Subject& subject) {
    ViewState& state = next.state;
    const Panel panel = *state.under;
    Drag drag{Drag::Kind::pan, event.button, panel, state.pointer_px};
    if (event.button == Button::right)
        drag.kind = Drag::Kind::zoom;
    else if (state.stylus.by_pointer && !is_slice(panel) && !event.modifiers.shift)
        drag.kind = Drag::Kind::rotate; // the left button is the hand's
    if (event.button == Button::left) {
        const bool twice = event.time_s - state.pressed_s < kDoubleClick_s &&
                           glm::distance(state.pointer_px, state.pressed_px) < kDoubleClick_px;
        state.pressed_s = twice ? -1e9 : event.time_s;
        state.pressed_px = state.pointer_px;
        const ToolEvent at{next, event, subject, panel, twice};
        const bool maximises = !is_slice(panel) || state.tool == &kCrosshairTool;
        std::optional<Drag::Kind> taken;
        drag.tool = state.tool;
        if (state.iso.pointing && is_slice(panel)) {
            state.iso.pointing = false;
            state.iso.picked = subject.value_at ? subject.value_at(at.point_mm()) : std::nullopt;
            drag.kind = Drag::Kind::nothing;
        } else if (twice && maximises && !state.w_held) {
            state.alone = state.alone ? std::nullopt : std::optional(panel);
            drag.kind = Drag::Kind::nothing;
        } else if (press_clip(state, subject, panel)) {
            drag.kind = Drag::Kind::clip;
        } else if (!state.w_held && state.tool->press && (taken = state.tool->press(at))) {
            drag.kind = *taken;
        } else if (!is_slice(panel)) {
            drag.kind = event.modifiers.shift  ? Drag::Kind::pan
                        : event.modifiers.ctrl ? Drag::Kind::roll
                                               : Drag::Kind::rotate;
        } else if (state.w_held) {
            drag.kind = Drag::Kind::window;
        } else {
            drag.tool = &kCrosshairTool;
            drag.kind = kCrosshairTool.press(at).value();
        }
    }
    state.drag = drag;
}

void drag_on(Outcome& next, const Event& event, const Subject& subject) {
    ViewState& state = next.state;
    Drag& drag = *state.drag;
    const std::optional<Box> box = box_of(state, drag.panel);
    if (!box) // the layout changed meanwhile
        return;
    const Grid& grid = subject.grid;
    const glm::dvec2 from = drag.last_px, to = state.pointer_px, by = to - from;
    const glm::dvec2 size(box->size_px);
    const auto slice = static_cast<size_t>(drag.panel);
    switch (drag.kind) {
        case Drag::Kind::window:
            drag_window(state, subject, by);
            break;
        case Drag::Kind::pan:
            if (is_slice(drag.panel))
                state.slices[slice].center_mm += point_under(state, grid, drag.panel, from) -
                                                 point_under(state, grid, drag.panel, to);
            else
                pan(state.camera, by, size);
            break;
        case Drag::Kind::zoom: { // upwards comes nearer
            const double times = std::pow(kZoomPerPx, -by.y);
            if (is_slice(drag.panel))
                zoom_slice(state, grid, drag.panel, times,
                           glm::dvec2(box->low_px) + 0.5 * size - 0.5);
            else
                zoom(state.camera, times, extent_mm(grid));
            break;
        }
        case Drag::Kind::rotate:
            rotate(state.camera, by, size);
            break;
        case Drag::Kind::roll: {
            const glm::dvec2 middle = glm::dvec2(box->low_px) + 0.5 * size;
            roll(state.camera, from - middle, to - middle);
            break;
        }
        case Drag::Kind::clip:
            drag_clip(state, subject, drag.panel);
            break;
        case Drag::Kind::tool:
        case Drag::Kind::turn:
            if (drag.tool->drag)
                drag.tool->drag({next, event, subject, drag.panel});
            break;
        case Drag::Kind::nothing:
            break;
    }
    drag.last_px = to;
}

void release(Outcome& next, const Event& event, const Subject& subject) {
    ViewState& state = next.state;
    if (!state.drag || state.drag->button != event.button)
        return;
    const Drag& drag = *state.drag;
    const ToolEvent at{next, event, subject, drag.panel};
    if (drag.kind == Drag::Kind::tool && drag.tool->release)
        drag.tool->release(at);
    if (drag.kind == Drag::Kind::rotate && state.tool->click && box_of(state, drag.panel) &&
        glm::distance(state.pointer_px, state.pressed_px) < kDoubleClick_px)
        state.tool->click(at);
    state.clipping.held.reset();
    state.drag.reset();
}

void turn_wheel(ViewState& state, const Event& event, const Subject& subject) {
    const Panel panel = *state.under;
    const double times = std::pow(kZoomPerNotch, event.wheel.y);
    if (!is_slice(panel))
        zoom(state.camera, times, extent_mm(subject.grid));
    else if (event.modifiers.ctrl)
        zoom_slice(state, subject.grid, panel, times, state.pointer_px);
    else
        page(state, subject.grid, panel, event.wheel.y);
}

void hover(ViewState& state, const Subject& subject) {
    const Panel panel = *state.under;
    if (is_slice(panel)) {
        move_crosshair(state, subject.grid,
                       point_under(state, subject.grid, panel, state.pointer_px));
        return;
    }
    if (!subject.pick)
        return;
    if (const auto met = subject.pick(ray_under(state, state.pointer_px)))
        move_crosshair(state, subject.grid, *met);
}

// Whether a question or a list of files is open: a click beside it is for none of the tools.
bool asks(const ViewState& state) {
    return state.leaving || state.file_question || state.saving_open || state.browser_open ||
           state.series_open || state.search_open || state.welcome_open;
}

std::optional<Panel> panel_under(const ViewState& state) {
    for (const Places::View& view : places_of(state).views)
        if (view.box.holds(state.pointer_px))
            return view.panel;
    return std::nullopt;
}

} // namespace

Outcome after(ViewState before, const Event& event, const Subject& subject) {
    Outcome next{std::move(before)};
    ViewState& state = next.state;
    if (event.kind != Event::Kind::move && !event.for_widget) // a widget may have gone
        state.under = panel_under(state);
    const bool in_view = state.under && !event.for_widget;
    switch (event.kind) {
        case Event::Kind::move:
            state.pointer_px = event.at_px;
            state.under = event.for_widget ? std::nullopt : panel_under(state);
            if (state.drag)
                drag_on(next, event, subject);
            else if (state.under && event.modifiers.shift)
                hover(state, subject);
            else if (state.stylus.by_pointer)
                point_hand(state, subject);
            if (!state.drag && state.tool->hover)
                state.tool->hover(state, subject);
            move_cursor(state, subject);
            break;
        case Event::Kind::button:
            if (event.down && in_view && !state.drag && asks(state)) {
                state.browser_open = state.series_open = state.search_open = state.welcome_open =
                    false; // questions stay
                break;
            }
            if (press_hand(state, event, subject, in_view))
                break;
            if (!event.down)
                release(next, event, subject);
            else if (in_view && !state.drag)
                press(next, event, subject);
            break;
        case Event::Kind::wheel:
            if (in_view && !state.drag && !wheel_hand(state, event, subject))
                turn_wheel(state, event, subject);
            if (in_view && state.stylus.by_pointer) // the plane has moved
                point_hand(state, subject);
            break;
        case Event::Kind::key:
            use_key(next, event, subject);
            break;
        case Event::Kind::text:
            break;
        case Event::Kind::resize:
            state.size_px = glm::max(event.size_px, kSmallestWindow_px);
            break;
        case Event::Kind::drop:
            if (!event.paths.empty())
                next.orders.push_back(order::Open{event.paths.front()});
            break;
        case Event::Kind::close:
            next.orders.push_back(order::Close{});
            break;
    }
    if (event.kind != Event::Kind::move && !event.for_widget) // boxes may have moved
        state.under = panel_under(state);
    return next;
}

glm::dvec2 line_of(const ViewState& state, Panel panel, Panel other) {
    const SliceView& here = state.slices[static_cast<size_t>(panel)];
    const glm::dvec3 line =
        glm::cross(here.towards, state.slices[static_cast<size_t>(other)].towards);
    const glm::dvec2 on_screen(glm::dot(line, here.right), -glm::dot(line, here.up));
    return glm::length(on_screen) > 1e-9 ? glm::normalize(on_screen) : glm::dvec2(1.0, 0.0);
}

std::vector<Handle> handles_of(const ViewState& state, const Grid& grid, Panel panel) {
    std::vector<Handle> handles;
    const std::optional<Box> box = box_of(state, panel);
    if (!box || !is_slice(panel))
        return handles;
    const glm::dvec2 middle = pixel_of(state, grid, panel, state.crosshair_mm).value();
    const double arm = kHandle_share * std::min(box->size_px.x, box->size_px.y);
    for (const Panel other : kPanels)
        if (is_slice(other) && other != panel)
            for (const double side : {-1.0, 1.0})
                handles.push_back({other, middle + side * arm * line_of(state, panel, other)});
    return handles;
}

} // namespace palpate::view
