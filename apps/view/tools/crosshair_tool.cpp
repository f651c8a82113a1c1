// The tool that shows one place in all views, and turns their planes.

#include <algorithm>
#include <cmath>

#include "apps/view/tools/tool.h"
#include "apps/view/window/camera_moves.h"

namespace palpate::view {

namespace {

// The planes other than the panel's own turn with the pointer about the crosshair.
void turn_planes(ViewState& state, const Grid& grid, Panel panel, glm::dvec2 from_px,
                 glm::dvec2 to_px) {
    const glm::dvec2 middle = pixel_of(state, grid, panel, state.crosshair_mm).value();
    const glm::dvec2 a = from_px - middle, b = to_px - middle;
    if (glm::length(a) < 2.0 || glm::length(b) < 2.0)
        return;
    // Rows count downwards, so that the angle is counter-clockwise with its sign turned.
    const double angle = std::atan2(-b.y, b.x) - std::atan2(-a.y, a.x);
    const glm::dvec3 axis = state.slices[static_cast<size_t>(panel)].towards;
    for (const Panel other : kPanels) {
        if (!is_slice(other) || other == panel)
            continue;
        SliceView& slice = state.slices[static_cast<size_t>(other)];
        slice.right = glm::normalize(turned(slice.right, axis, angle));
        slice.towards = glm::normalize(turned(slice.towards, axis, angle));
        slice.up = glm::cross(slice.towards, slice.right);
        slice.center_mm =
            state.crosshair_mm + turned(slice.center_mm - state.crosshair_mm, axis, angle);
    }
}

std::optional<Drag::Kind> press_crosshair(const ToolEvent& at) {
    ViewState& state = at.state();
    if (!is_slice(at.panel))
        return std::nullopt;
    const std::vector<Handle> handles = state.crosshair_shown
                                            ? handles_of(state, at.subject.grid, at.panel)
                                            : std::vector<Handle>{};
    if (std::any_of(handles.begin(), handles.end(), [&](const Handle& handle) {
            return glm::distance(handle.at_px, state.pointer_px) <= kHandle_px;
        }))
        return Drag::Kind::turn;
    move_crosshair(state, at.subject.grid, at.point_mm());
    return Drag::Kind::tool;
}

void drag_crosshair(const ToolEvent& at) {
    ViewState& state = at.state();
    if (state.drag->kind == Drag::Kind::turn)
        turn_planes(state, at.subject.grid, at.panel, state.drag->last_px, state.pointer_px);
    else
        move_crosshair(state, at.subject.grid, at.point_mm());
}

} // namespace

constinit const Tool kCrosshairTool{.name = "crosshair",
                                    .title = "crosshair",
                                    .key = "c",
                                    .help = "shows one place in all views",
                                    .icon = Icon::crosshair,
                                    .press = press_crosshair,
                                    .drag = drag_crosshair,
                                    .first_button = Carve::nothing};

} // namespace palpate::view
