#include "apps/view/tools/hand_pointer.h"

#include <algorithm>
#include <cmath>

#include "apps/view/tools/palette.h"
#include "engine/volume/extent.h"
#include "haptics/core/workspace.h"

namespace palpate::view {

namespace {

// How deep along the view the tool goes for a pointer over what is seen. A ray goes through a
// narrow hole to what lies far behind it, and the tool stays at the hole's edge: where the ray ends
// kThrough radii below all that is seen round about.
std::optional<double> depth_of_seen(const ViewState& state, const Subject& subject,
                                    const View& view, const Ray& ray) {
    constexpr double kThrough = 8.0, kAround = 1.25; // in radii of the tool
    const auto depth = [&](glm::dvec3 aside) -> std::optional<double> {
        const auto seen = subject.pick({ray.origin_mm + aside, ray.direction});
        return seen ? std::optional(glm::dot(view.forward, *seen - view.eye_mm)) : std::nullopt;
    };
    const std::optional<double> middle = depth(glm::dvec3(0.0));
    if (!middle)
        return middle;
    double edge = -INFINITY;
    for (const glm::dvec3 aside : {view.right, view.up, -view.right, -view.up}) {
        const auto found = depth(kAround * state.radius_mm * aside);
        edge = std::max(edge, found.value_or(INFINITY));
    }
    return edge < *middle - kThrough * state.radius_mm ? edge : *middle;
}

// The point of a ray that is so deep along the view.
glm::dvec3 at_depth(const View& view, const Ray& ray, double depth_mm) {
    const double from_mm = glm::dot(view.forward, ray.origin_mm - view.eye_mm);
    return ray.origin_mm +
           ray.direction * (depth_mm - from_mm) / glm::dot(ray.direction, view.forward);
}

// How deep a pressed tool goes on its way to the pointer: along what is seen, by steps, up to 63
// degrees off the picture's plane. Over an edge, as that of an opening, it stays as deep as it was.
double followed_depth(const ViewState& state, const Subject& subject, const View& view,
                      Panel panel) {
    constexpr double kSteep = 2.0;
    constexpr int kSteps = 8;
    const Box box = box_of(state, panel).value();
    const glm::dvec2 low(box.low_px), to = state.pointer_px;
    const glm::dvec2 from =
        pixel_of(state, subject.grid, panel, state.stylus.meant.position_mm).value_or(to);
    const auto ray_at = [&](double share) {
        return ray_through(view, glm::mix(from, to, share) - low, glm::uvec2(box.size_px));
    };
    double depth_mm = state.stylus.depth_mm;
    for (int step = 1; step <= kSteps; ++step) {
        const Ray before = ray_at(double(step - 1) / kSteps), there = ray_at(double(step) / kSteps);
        const double away_mm =
            glm::distance(at_depth(view, before, depth_mm), at_depth(view, there, depth_mm));
        const auto seen_mm = depth_of_seen(state, subject, view, there);
        if (seen_mm && std::abs(*seen_mm - depth_mm) <= state.radius_mm + kSteep * away_mm)
            depth_mm = *seen_mm;
    }
    return depth_mm;
}

} // namespace

void point_hand(ViewState& state, const Subject& subject) {
    if (!state.under)
        return;
    Stylus& stylus = state.stylus;
    const Panel panel = *state.under;
    stylus.clear_mm = 0.0;
    if (is_slice(panel)) {
        const SliceView& slice = state.slices[static_cast<size_t>(panel)];
        stylus.meant = {point_under(state, subject.grid, panel, state.pointer_px),
                        haptics::aligned_with_view(slice.right, slice.up)};
        return;
    }
    const Box box = box_of(state, panel).value();
    const glm::uvec2 size(box.size_px);
    const View view = make_view(state.camera, size);
    const Ray ray = ray_through(view, state.pointer_px - glm::dvec2(box.low_px), size);
    const auto depth_of = [&](glm::dvec3 p) { return glm::dot(view.forward, p - view.eye_mm); };
    const glm::dquat turn = haptics::aligned_with_view(view.right, view.up);
    const std::vector<Widget3d> palette = palette_of(state);
    if (const auto met = widget_met(palette, ray)) { // over it, or far enough down to press it
        const double travel_mm = palette[met->number].plate.travel_mm;
        const double over_mm = stylus.presses_widget
                                   ? felt_radius_mm(state.radius_mm, subject.grid) - 2.0 * travel_mm
                                   : state.radius_mm + 0.5 * travel_mm;
        stylus.meant = {met->at_mm - over_mm * view.forward, turn};
        return;
    }
    if (stylus.on_surface && subject.pick)
        stylus.depth_mm = stylus.buttons == 0
                              ? depth_of_seen(state, subject, view, ray).value_or(stylus.depth_mm)
                              : followed_depth(state, subject, view, panel);
    if (stylus.depth_mm <= 0.0)
        stylus.depth_mm = depth_of(state.camera.target_mm);
    const double depth_mm = std::max(1e-3, stylus.depth_mm + stylus.push_mm);
    stylus.meant = {at_depth(view, ray, depth_mm), turn};
    if (!stylus.on_surface)
        return;                          // the depth is the person's
    constexpr double kParallel_mm = 1e6; // from which the rays of a parallel view come
    stylus.clear_mm = 2.0 * state.radius_mm;
    stylus.eye_mm = view.projection == Projection::orthographic
                        ? stylus.meant.position_mm - kParallel_mm * view.forward
                        : view.eye_mm;
}

void begin_hand(ViewState& state, const Subject& subject) {
    if (!state.tools_open) // a view fills the screen
        state.touch_open = false;
    else if (state.task != WindowTask::drill) // which has the rows of touch itself
        state.touch_open = true;
    const Camera& camera = state.camera;
    const glm::dvec3 arm = camera.eye_mm - camera.target_mm;
    const double reach_mm = 0.55 * glm::length(glm::dmat3(subject.grid.world_from_index) *
                                               glm::dvec3(subject.grid.size));
    state.stylus.meant = {center_mm(subject.grid) + reach_mm * glm::normalize(arm)};
    state.stylus.clear_mm = 0.0;
    state.stylus.buttons = 0;
}

double felt_radius_mm(double radius_mm, const Grid& grid) {
    return std::max(0.0, radius_mm - largest_spacing_mm(grid));
}

bool is_tool_with_hand(const Stylus& stylus, double radius_mm, glm::dvec3 hand_mm,
                       glm::dvec3 tool_mm) {
    if (!stylus.by_pointer || stylus.clear_mm <= 0.0)
        return true;
    // A surface holds the tool's middle off by its radius, and by how deep it is pushed; where it
    // is steep, that is beside the hand.
    const double most_mm = 1.5 * radius_mm + std::max(0.0, stylus.push_mm);
    const glm::dvec3 forward = glm::normalize(stylus.meant.position_mm - stylus.eye_mm),
                     off = tool_mm - hand_mm;
    return glm::length(off - glm::dot(off, forward) * forward) <= most_mm;
}

bool press_hand(ViewState& state, const Event& event, const Subject& subject, bool in_view) {
    if (event.button == Button::middle)
        return false;
    if (event.button == Button::left && !event.down && state.stylus.presses_widget) {
        state.stylus.presses_widget = false;
        point_hand(state, subject);
        return true;
    }
    const uint32_t bit = event.button == Button::left ? 1u : 2u;
    const bool held = (state.stylus.buttons & bit) != 0;
    if (!event.down) {
        state.stylus.buttons &= ~bit;
        return held;
    }
    if (!state.stylus.by_pointer || !in_view || state.drag || state.w_held ||
        event.modifiers.shift || event.modifiers.ctrl)
        return false;
    point_hand(state, subject); // the move here may have been a widget's, as where one was left
    if (event.button == Button::left && !is_slice(*state.under)) {
        const Box box = box_of(state, *state.under).value();
        const glm::uvec2 size(box.size_px);
        if (widget_met(palette_of(state),
                       ray_through(make_view(state.camera, size),
                                   state.pointer_px - glm::dvec2(box.low_px), size))) {
            state.stylus.presses_widget = true;
            point_hand(state, subject);
            return true;
        }
    }
    state.stylus.buttons |= bit;
    return true;
}

bool wheel_hand(ViewState& state, const Event& event, const Subject& subject) {
    if (!state.stylus.by_pointer || event.modifiers.ctrl || is_slice(*state.under))
        return false;
    constexpr double kMost_mm = 1000.0;
    const double step_mm = smallest_spacing_mm(subject.grid);
    state.stylus.push_mm =
        std::clamp(state.stylus.push_mm + step_mm * event.wheel.y, -kMost_mm, kMost_mm);
    return true;
}

} // namespace palpate::view
