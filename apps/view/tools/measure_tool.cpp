#include "apps/view/tools/measure_tool.h"

#include <algorithm>
#include <cmath>

#include "engine/session/default_scene.h"

namespace palpate::view {

namespace {

constexpr double kOneDrag_px = 5.0; // a drag longer than this puts two points

std::optional<MeasureHandle> handle_under(const ViewState& state, const Grid& grid, Panel panel) {
    std::optional<MeasureHandle> nearest;
    double least = kMeasureHandle_px;
    for (const MeasureHandle& handle : measure_handles(state, grid, panel))
        if (const double away = glm::distance(handle.at_px, state.pointer_px); away <= least) {
            least = away;
            nearest = handle;
        }
    return nearest;
}

void finish(ViewState& state) {
    Measuring& measuring = state.measuring;
    Measure made{measuring.kind, std::exchange(measuring.begun, {})};
    if (!check(made)) // as of a sphere's two points in one place
        return;
    state.notes.measures.push_back(std::move(made));
    measuring.selected = state.notes.measures.size() - 1;
}

void add_point(ViewState& state, glm::dvec3 point) {
    Measuring& measuring = state.measuring;
    measuring.begun.push_back(point);
    measuring.selected.reset();
    if (measuring.begun.size() == points_needed(measuring.kind))
        finish(state);
}

Ray ray_under(const ViewState& state, Panel panel) {
    const Box box = box_of(state, panel).value();
    const glm::uvec2 size(box.size_px);
    return ray_through(make_view(state.camera, size), state.pointer_px - glm::dvec2(box.low_px),
                       size);
}

std::optional<glm::dvec3> seen_under(const ViewState& state, const Subject& subject, Panel panel) {
    return subject.pick ? subject.pick(ray_under(state, panel)) : std::nullopt;
}

// The point where a line along `direction` through `point` meets a plane; nothing if too flat.
std::optional<glm::dvec3> on_plane(glm::dvec3 point, glm::dvec3 direction, glm::dvec3 in_plane,
                                   glm::dvec3 normal) {
    const double steep = glm::dot(direction, normal);
    if (std::abs(steep) < 0.05)
        return std::nullopt;
    return point + glm::dot(in_plane - point, normal) / steep * direction;
}

} // namespace

bool lies_in(const ViewState& state, const Grid& grid, Panel panel, glm::dvec3 point_mm) {
    const SliceView& slice = state.slices[static_cast<size_t>(panel)];
    return std::abs(glm::dot(point_mm - state.crosshair_mm, slice.towards)) <=
           0.501 * layer_step_mm(grid, slice.towards);
}

std::vector<MeasureHandle> measure_handles(const ViewState& state, const Grid& grid, Panel panel) {
    std::vector<MeasureHandle> handles;
    const auto& measures = state.notes.measures;
    for (size_t m = 0; m < measures.size(); ++m) {
        if (!is_slice(panel) && measures[m].kind == MeasureKind::polygon)
            continue;
        for (size_t p = 0; p < measures[m].points_mm.size(); ++p) {
            const glm::dvec3 point = measures[m].points_mm[p];
            if (is_slice(panel) && !lies_in(state, grid, panel, point))
                continue;
            if (const auto at = pixel_of(state, grid, panel, point))
                handles.push_back({m, p, *at});
        }
    }
    return handles;
}

namespace {

std::optional<Drag::Kind> press_measure(const ToolEvent& at) {
    ViewState& state = at.state();
    const Subject& subject = at.subject;
    const Panel panel = at.panel;
    Measuring& measuring = state.measuring;
    if (measuring.begun.empty())
        if (const auto handle = handle_under(state, subject.grid, panel)) {
            measuring.selected = handle->measure;
            measuring.held = handle->point;
            return Drag::Kind::tool;
        }
    if (!is_slice(panel))
        return std::nullopt; // the camera turns; click_measure() is told of a click
    glm::dvec3 point = at.point_mm();
    const glm::dvec3 towards = state.slices[static_cast<size_t>(panel)].towards;
    if (measuring.kind != MeasureKind::polygon) {
        add_point(state, point);
        return Drag::Kind::tool;
    }
    auto& begun = measuring.begun;
    if (begun.empty()) {
        measuring.normal = towards;
    } else {
        const auto met = on_plane(point, towards, begun.front(), measuring.normal);
        if (!met)
            return Drag::Kind::tool; // another slice, across the polygon's plane
        point = *met;
    }
    const auto first =
        begun.empty() ? std::nullopt : pixel_of(state, subject.grid, panel, begun.front());
    const bool closes = first && glm::distance(*first, state.pointer_px) <= kMeasureHandle_px;
    if (begun.size() >= 3 && (at.twice || closes))
        finish(state);
    else if (!at.twice)
        add_point(state, point);
    return Drag::Kind::tool;
}

void drag_measure(const ToolEvent& at) {
    ViewState& state = at.state();
    const Panel panel = at.panel;
    Measuring& measuring = state.measuring;
    if (!measuring.held || !measuring.selected)
        return;
    Measure& measure = state.notes.measures[*measuring.selected];
    glm::dvec3& point = measure.points_mm[*measuring.held];
    const bool is_sphere = measure.kind == MeasureKind::sphere;
    std::optional<glm::dvec3> to;
    if (is_slice(panel)) {
        const glm::dvec3 towards = state.slices[static_cast<size_t>(panel)].towards;
        const bool in_own_plane = measure.kind == MeasureKind::polygon &&
                                  plane_normal(measure.points_mm) != glm::dvec3(0.0);
        to = on_plane(at.point_mm(), towards, point,
                      in_own_plane ? plane_normal(measure.points_mm) : towards);
    } else {
        if (!is_sphere || *measuring.held == 0)
            to = seen_under(state, at.subject, panel);
        const Ray ray = ray_under(state, panel);
        if (!to)
            to = on_plane(ray.origin_mm, ray.direction, point,
                          make_view(state.camera, glm::uvec2(1)).forward);
    }
    if (!to)
        return;
    Measure moved = measure;
    if (is_sphere && *measuring.held == 0)
        moved.points_mm[1] += *to - point;
    moved.points_mm[*measuring.held] = *to;
    if (check(moved))
        measure = std::move(moved);
}

void release_measure(const ToolEvent& at) {
    ViewState& state = at.state();
    Measuring& measuring = state.measuring;
    if (std::exchange(measuring.held, std::nullopt) || !is_slice(at.panel) ||
        !box_of(state, at.panel))
        return;
    if (measuring.begun.size() == 1 &&
        glm::distance(state.pointer_px, state.pressed_px) > kOneDrag_px)
        add_point(state, at.point_mm());
}

void click_measure(const ToolEvent& at) {
    ViewState& state = at.state();
    if (state.measuring.kind == MeasureKind::polygon) // is drawn in slices
        return;
    if (const auto seen = seen_under(state, at.subject, at.panel))
        add_point(state, *seen);
}

bool cancel_measure(ViewState& state) {
    Measuring& measuring = state.measuring;
    if (!measuring.begun.empty()) {
        measuring.begun.clear();
        return true;
    }
    return std::exchange(measuring.selected, std::nullopt).has_value();
}

void take_measure(ViewState& state, bool again) {
    Measuring& measuring = state.measuring;
    if (again)
        measuring.kind = static_cast<MeasureKind>((static_cast<int>(measuring.kind) + 1) % 4);
    measuring.begun.clear();
}

bool use_measure_key(Outcome& next, const Event& event, const Subject&) {
    Measuring& measuring = next.state.measuring;
    const std::string& key = event.key;
    if ((key == "delete" || key == "backspace") && measuring.selected) {
        auto& measures = next.state.notes.measures;
        measures.erase(measures.begin() + static_cast<ptrdiff_t>(*measuring.selected));
        measuring.selected.reset();
        return true;
    }
    if (key == "enter" && measuring.kind == MeasureKind::polygon && measuring.begun.size() >= 3) {
        finish(next.state);
        return true;
    }
    return false;
}

std::string kind_of_measure(const ViewState& state) {
    return name_of(state.measuring.kind);
}

std::string how_to_measure(const ViewState& state) {
    return fmt::format("measure: {}; {}", name_of(state.measuring.kind),
                       placing_of(state.measuring.kind));
}

} // namespace

const char* placing_of(MeasureKind kind) {
    constexpr const char* hints[] = {"click or drag both ends",
                                     "click end, vertex, end, or drag the first arm",
                                     "click corners in a slice; Enter or a double click ends",
                                     "drag from the centre to the rim"};
    return hints[static_cast<size_t>(kind)];
}

constinit const Tool kMeasureTool{
    .name = "measure",
    .title = "measure",
    .key = "m",
    .help = "ruler, angle, polygon, sphere, by turns; Delete removes (task Measure)",
    .icon = Icon::ruler,
    .group = ToolGroup::measure,
    .press = press_measure,
    .drag = drag_measure,
    .release = release_measure,
    .abort = [](const ToolEvent& at) { at.state().measuring.held.reset(); },
    .click = click_measure,
    .cancel = cancel_measure,
    .use_key = use_measure_key,
    .take = take_measure,
    .marks = draw_measures,
    .how_to = how_to_measure,
    .kind = kind_of_measure,
};

} // namespace palpate::view
