#include "apps/palpate/view/mesh_tool.h"

namespace palpate::view {

namespace {
constexpr double kGrip_px = 12.0; // in slices: as far from the mesh
} // namespace

bool press_mesh(Outcome& next, const Event& event, const Subject& subject, Panel panel) {
    ViewState& state = next.state;
    std::optional<glm::dvec3> met;
    if (!is_slice(panel)) {
        if (subject.mesh_met)
            met = subject.mesh_met(ray_under(state, state.pointer_px));
    } else if (subject.mesh_near) {
        const double px = mm_per_px(state.slices[static_cast<size_t>(panel)], subject.grid,
                                    box_of(state, panel).value().size_px);
        met = subject.mesh_near(point_under(state, subject.grid, panel, state.pointer_px),
                                kGrip_px * px);
    }
    if (!met)
        return false;
    state.pulling.held_mm = *met;
    next.orders.push_back({Order::Kind::pull_down, *met, event.time_s});
    return true;
}

void drag_mesh(Outcome& next, const Event& event, const Subject& subject, Panel panel) {
    ViewState& state = next.state;
    const glm::dvec3 held = state.pulling.held_mm;
    glm::dvec3 goal;
    if (is_slice(panel)) {
        goal = point_under(state, subject.grid, panel, state.pointer_px);
        const glm::dvec3 towards = state.slices[static_cast<size_t>(panel)].towards;
        goal += glm::dot(held - goal, towards) * towards; // as far from the plane as it was
    } else {
        const Ray ray = ray_under(state, state.pointer_px);
        const glm::dvec3 away = glm::normalize(state.camera.target_mm - state.camera.eye_mm);
        const double along = glm::dot(ray.direction, away);
        if (!(along > 0.0))
            return;
        goal = ray.origin_mm + glm::dot(held - ray.origin_mm, away) / along * ray.direction;
    }
    next.orders.push_back({Order::Kind::pull_move, goal, event.time_s});
}

} // namespace palpate::view
