#include "apps/view/tools/mesh_tool.h"

namespace palpate::view {

namespace {
constexpr double kGrip_px = 12.0; // in slices: as far from the mesh

std::optional<Drag::Kind> press_mesh(const ToolEvent& at) {
    ViewState& state = at.state();
    const Subject& subject = at.subject;
    const Panel panel = at.panel;
    std::optional<glm::dvec3> met;
    if (state.stylus.by_pointer) // the left button is the hand's
        return std::nullopt;
    if (!is_slice(panel)) {
        if (subject.mesh_met)
            met = subject.mesh_met(ray_under(state, state.pointer_px));
    } else if (subject.mesh_near) {
        const double px = mm_per_px(state.slices[static_cast<size_t>(panel)], subject.grid,
                                    box_of(state, panel).value().size_px);
        met = subject.mesh_near(at.point_mm(), kGrip_px * px);
    }
    if (!met)
        return std::nullopt;
    state.own.of<Pulling>().held_mm = *met;
    at.order(order::PullDown{*met});
    return Drag::Kind::tool;
}

void drag_mesh(const ToolEvent& at) {
    const ViewState& state = at.state();
    const glm::dvec3 held = state.own.of<Pulling>().held_mm;
    glm::dvec3 goal;
    if (is_slice(at.panel)) {
        goal = at.point_mm();
        const glm::dvec3 towards = state.slices[static_cast<size_t>(at.panel)].towards;
        goal += glm::dot(held - goal, towards) * towards; // as far from the plane as it was
    } else {
        const Ray ray = ray_under(state, state.pointer_px);
        const glm::dvec3 away = glm::normalize(state.camera.target_mm - state.camera.eye_mm);
        const double along = glm::dot(ray.direction, away);
        if (!(along > 0.0))
            return;
        goal = ray.origin_mm + glm::dot(held - ray.origin_mm, away) / along * ray.direction;
    }
    at.order(order::PullMove{goal});
}

} // namespace

constinit const Tool kPullTool{
    .name = "pull",
    .title = nullptr, // a mesh comes first: the task Segment has both
    .key = nullptr,
    .help = "pulls the mesh of a label",
    .group = ToolGroup::paint,
    .press = press_mesh,
    .drag = drag_mesh,
    .release = [](const ToolEvent& at) { at.order(order::PullUp{}); },
    .abort = [](const ToolEvent& at) { at.order(order::PullCancel{}); },
    .marks = draw_mesh,
};

} // namespace palpate::view
