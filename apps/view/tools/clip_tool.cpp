#include "apps/view/tools/clip_tool.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "apps/view/window/interaction.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

using Polygon = std::vector<glm::dvec3>;

// The part of a convex polygon that lies where dot(normal, x) >= offset - room.
Polygon cut(const Polygon& polygon, glm::dvec3 normal, double offset, double room) {
    Polygon kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        const double da = glm::dot(normal, a) - offset + room,
                     db = glm::dot(normal, b) - offset + room;
        if (da >= 0.0)
            kept.push_back(a);
        if ((da >= 0.0) != (db >= 0.0))
            kept.push_back(a + da / (da - db) * (b - a));
    }
    return kept;
}

double box_size(const Grid& grid) {
    return glm::length(glm::dmat3(grid.world_from_index) * glm::dvec3(grid.size));
}

glm::dvec3 middle_of(const Polygon& polygon) {
    glm::dvec3 sum(0.0);
    for (const glm::dvec3 p : polygon)
        sum += p;
    return sum / static_cast<double>(polygon.size());
}

// So that the plane still meets the volume's box.
void move_through(ClipPlane& plane, const Grid& grid, glm::dvec3 point) {
    double least = INFINITY, most = -INFINITY;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index =
            glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * (glm::dvec3(grid.size) - 1.0);
        const double along = glm::dot(plane.normal, world_point(grid, index));
        least = std::min(least, along);
        most = std::max(most, along);
    }
    const double is = glm::dot(plane.normal, point);
    plane.point_mm = point + (std::clamp(is, least, most) - is) * plane.normal;
}

} // namespace

std::vector<glm::dvec3> clip_outline(const Grid& grid, const std::vector<ClipPlane>& planes,
                                     size_t number) {
    const ClipPlane& plane = planes[number];
    const glm::dvec3 n = glm::normalize(plane.normal), a = glm::abs(n);
    const glm::dvec3 other = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                             : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                      : glm::dvec3(0, 0, 1);
    const glm::dvec3 u = glm::normalize(glm::cross(other, n)), v = glm::cross(n, u);
    const glm::dvec3 center = center_mm(grid);
    const glm::dvec3 at = center + glm::dot(plane.point_mm - center, n) * n;
    const double size = box_size(grid), room = 1e-6 * size; // a plane may lie on a face
    Polygon polygon{at - size * u - size * v, at + size * u - size * v, at + size * u + size * v,
                    at - size * u + size * v};
    for (const HalfSpace& side : half_spaces(grid))
        polygon = cut(polygon, side.normal, side.offset, room);
    for (size_t i = 0; i < planes.size(); ++i)
        if (i != number)
            polygon = cut(polygon, planes[i].normal, glm::dot(planes[i].normal, planes[i].point_mm),
                          room);
    return polygon;
}

std::optional<std::pair<glm::dvec3, glm::dvec3>> clip_line(const ViewState& state, const Grid& grid,
                                                           Panel panel, size_t number) {
    const Polygon outline = clip_outline(grid, state.notes.clip_planes, number);
    const glm::dvec3 towards = state.slices[static_cast<size_t>(panel)].towards;
    std::vector<glm::dvec3> ends;
    for (size_t i = 0; i < outline.size(); ++i) {
        const glm::dvec3 a = outline[i], b = outline[(i + 1) % outline.size()];
        const double da = glm::dot(a - state.crosshair_mm, towards),
                     db = glm::dot(b - state.crosshair_mm, towards);
        if ((da >= 0.0) != (db >= 0.0))
            ends.push_back(a + da / (da - db) * (b - a));
    }
    return ends.size() == 2 ? std::optional(std::pair(ends[0], ends[1])) : std::nullopt;
}

std::vector<ClipHandle> clip_handles(const ViewState& state, const Grid& grid, Panel panel) {
    std::vector<ClipHandle> handles;
    if (!is_shown(state, Section::clips))
        return handles;
    const auto add = [&](size_t plane, bool turns, glm::dvec3 at) {
        if (const auto px = pixel_of(state, grid, panel, at))
            handles.push_back({plane, turns, at, *px});
    };
    for (size_t i = 0; i < state.notes.clip_planes.size(); ++i) {
        if (is_slice(panel)) {
            if (const auto line = clip_line(state, grid, panel, i)) {
                add(i, false, 0.5 * (line->first + line->second));
                add(i, true, 0.25 * line->first + 0.75 * line->second);
            }
        } else if (const Polygon outline = clip_outline(grid, state.notes.clip_planes, i);
                   outline.size() >= 3) {
            add(i, false, middle_of(outline));
        }
    }
    return handles;
}

bool press_clip(ViewState& state, const Subject& subject, Panel panel) {
    const ClipHandle* nearest = nullptr;
    const auto handles = clip_handles(state, subject.grid, panel);
    double least = kHandle_px + 1.0;
    for (const ClipHandle& handle : handles)
        if (const double away = glm::distance(handle.at_px, state.pointer_px); away < least) {
            least = away;
            nearest = &handle;
        }
    if (!nearest)
        return false;
    Clipping& clipping = state.clipping;
    clipping.selected = clipping.held = nearest->plane;
    clipping.turns = nearest->turns;
    clipping.held_mm = nearest->at_mm;
    if (nearest->turns) // about the line's middle
        if (const auto line = clip_line(state, subject.grid, panel, nearest->plane))
            clipping.held_mm = 0.5 * (line->first + line->second);
    return true;
}

void drag_clip(ViewState& state, const Subject& subject, Panel panel) {
    Clipping& clipping = state.clipping;
    if (!clipping.held || *clipping.held >= state.notes.clip_planes.size())
        return;
    ClipPlane& plane = state.notes.clip_planes[*clipping.held];
    const Grid& grid = subject.grid;
    if (!is_slice(panel)) {
        const Box box = box_of(state, panel).value();
        const glm::uvec2 size(box.size_px);
        const Ray ray = ray_through(make_view(state.camera, size),
                                    state.pointer_px - glm::dvec2(box.low_px), size);
        const glm::dvec3 w = clipping.held_mm - ray.origin_mm;
        const double b = glm::dot(plane.normal, ray.direction), across = 1.0 - b * b;
        if (across > 1e-3)
            move_through(
                plane, grid,
                clipping.held_mm + (b * glm::dot(ray.direction, w) - glm::dot(plane.normal, w)) /
                                       across * plane.normal);
        return;
    }
    const glm::dvec3 to = point_under(state, grid, panel, state.pointer_px);
    if (!clipping.turns) {
        move_through(plane, grid, to);
        return;
    }
    const SliceView& slice = state.slices[static_cast<size_t>(panel)];
    const glm::dvec3 arm = to - clipping.held_mm;
    if (glm::length(arm) < 2.0 * mm_per_px(slice, grid, box_of(state, panel)->size_px))
        return;
    // The line shall run along the arm, in the sense that is nearer.
    glm::dvec3 line = glm::cross(slice.towards, plane.normal);
    if (glm::length(line) < 1e-9)
        return;
    line = glm::normalize(line);
    if (glm::dot(line, arm) < 0.0)
        line = -line;
    const double angle =
        std::atan2(glm::dot(glm::cross(line, arm), slice.towards), glm::dot(line, arm));
    plane.normal = glm::normalize(glm::dmat3(glm::rotate(glm::dmat4(1.0), angle, slice.towards)) *
                                  plane.normal);
    plane.point_mm = clipping.held_mm;
}

void add_clip_plane(ViewState& state) {
    if (state.notes.clip_planes.size() >= kMaxClipPlanes)
        return;
    const glm::dvec3 away = glm::normalize(state.camera.target_mm - state.camera.eye_mm);
    state.notes.clip_planes.push_back({state.crosshair_mm, away});
    state.clipping.selected = state.notes.clip_planes.size() - 1;
}

void set_crop_box(ViewState& state, const Grid& grid) {
    constexpr double kShare = 0.1;
    state.notes.clip_planes.clear();
    for (HalfSpace side : half_spaces(grid)) {
        side.offset /= glm::length(side.normal);
        side.normal = glm::normalize(side.normal);
        double depth = 0.0; // of the box, seen from this face
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 index = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) *
                                     (glm::dvec3(grid.size) - 1.0);
            depth = std::max(depth, glm::dot(side.normal, world_point(grid, index)) - side.offset);
        }
        const glm::dvec3 center = center_mm(grid);
        const double to_face = glm::dot(side.normal, center) - side.offset;
        state.notes.clip_planes.push_back(
            {center - (to_face - kShare * depth) * side.normal, side.normal});
    }
    state.clipping.selected.reset();
}

} // namespace palpate::view
