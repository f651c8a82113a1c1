#include "haptics/proxy/rest.h"

#include <algorithm>
#include <array>

#include "haptics/field/coupling.h"
#include "haptics/proxy/planes.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// A point that was in front of a face may be found so far behind it: see kSkin_mm.
constexpr double kBehind_mm = 1e-5, kResting_mm = 1e-7, kConverged_mm = 1e-4;

// How much of the way from a point of the box, 0 .. 1, lies within it.
double share_within(dvec3 from, dvec3 to, dvec3 low, dvec3 high) {
    double share = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double way = to[axis] - from[axis];
        if (to[axis] > high[axis])
            share = std::min(share, std::max(0.0, (high[axis] - from[axis]) / way));
        if (to[axis] < low[axis])
            share = std::min(share, std::max(0.0, (low[axis] - from[axis]) / way));
    }
    return share;
}

// Back on its way, which is known to be free, until it is off the face: straight off the face there
// may be another one, in a crease.
dvec3 off_the_face(const SurfacePoint& hit, dvec3 from, dvec3 direction) {
    const double descent = -glm::dot(hit.face_normal, direction);
    return from + std::max(0.0, hit.distance - kSkin_mm / std::max(descent, 1e-9)) * direction;
}

Rest felt_where_it_is(Rest rest) {
    rest.curved = rest.point;
    return rest;
}

// Touching a face: felt as far out as the face bulges there.
Rest touching_at(dvec3 point, const SurfacePoint& face) {
    return {.point = point,
            .curved = point + (face.curved - face.point),
            .face_normal = face.face_normal,
            .shaded_normal = face.shaded_normal,
            .touching = face.found};
}

} // namespace

Rest come_to_rest(const TriangleSpan& surface, dvec3 from, dvec3 goal, dvec3 low, dvec3 high) {
    Rest rest{.point = from, .curved = from};
    std::array<Plane, 3> planes;
    uint32_t count = 0, oldest = 0;
    dvec3 settled = from; // where it was when it last looked straight at the goal
    for (int i = 0; i < 48 && !surface.is_spent(); ++i) {
        const Projection way = project_to_planes(goal, {planes.data(), count});
        dvec3 target = way.is_feasible ? way.point : rest.point;
        const double share = share_within(rest.point, target, low, high);
        target = rest.point + share * (target - rest.point);
        const SurfacePoint hit = first_crossing(surface, rest.point, target, kBehind_mm);
        if (hit.found) {
            // The plane may be further out than that; then the next step, which is swept, too, goes
            // there.
            rest.point = off_the_face(hit, rest.point, unit_or_zero(target - rest.point));
            rest.face_normal = hit.face_normal;
            rest.shaded_normal = hit.shaded_normal;
            rest.touching = true;
            const Plane plane{hit.face_normal, glm::dot(hit.face_normal, hit.point) + kSkin_mm};
            if (count < 3) {
                planes[count++] = plane;
            } else { // a fourth one: the one met longest ago lets go
                planes[oldest] = plane;
                oldest = (oldest + 1) % 3;
            }
            continue;
        }
        rest.point = target;
        if (share < 1.0) {
            rest.reached_side = true;
            return felt_where_it_is(rest);
        }
        if (count == 0) {
            rest.touching = false;
            return felt_where_it_is(rest);
        }
        if (glm::distance(rest.point, settled) < kResting_mm)
            return felt_where_it_is(rest);
        settled = rest.point;
        count = oldest = 0;
    }
    rest.reached_side = surface.is_spent(); // it is on its way still
    return felt_where_it_is(rest);
}

dvec3 off_the_faces(const TriangleSpan& surface, dvec3 point) {
    const SurfacePoint near = nearest_point(surface, point, 0.9 * kSkin_mm);
    if (!near.found)
        return point;
    const double above = glm::dot(point - near.point, near.face_normal);
    const dvec3 way = (kSkin_mm - above) * near.face_normal;
    const SurfacePoint hit = first_crossing(surface, point, point + way);
    return hit.found ? point + 0.5 * hit.distance * near.face_normal : point + way;
}

Rest rest_at(const TriangleSpan& surface, dvec3 point, double within_mm) {
    return touching_at(point, nearest_point(surface, point, within_mm));
}

Rest rest_under_bulge(const TriangleSpan& surface, dvec3 goal) {
    const double reach = 2.0 * surface.bulge_mm;
    if (reach > 0.0) {
        const SurfacePoint near = nearest_point(surface, goal, reach);
        if (near.found && glm::dot(goal - near.point, near.face_normal) > 0.0 &&
            glm::dot(goal - near.curved, near.shaded_normal) < 0.0) {
            // Down to it, and off it again on that way.
            const SurfacePoint hit =
                first_crossing(surface, goal, goal + 1.5 * (near.point - goal), kBehind_mm);
            if (hit.found)
                return touching_at(off_the_face(hit, goal, unit_or_zero(near.point - goal)), hit);
        }
    }
    return {.point = goal, .curved = goal};
}

Rest settle(const TriangleSpan& surface, Rest rest, dvec3 goal, dvec3 low, dvec3 high,
            double grain_mm) {
    constexpr int kMostSteps = 16;
    // Along a way until something is met.
    struct Leg {
        dvec3 end;
        SurfacePoint hit;
    };
    const auto leg = [&](dvec3 from, dvec3 way) -> Leg {
        const double share = share_within(from, from + way, low, high);
        const SurfacePoint hit = first_crossing(surface, from, from + share * way, kBehind_mm);
        rest.reached_side |= share < 1.0 && !hit.found;
        return {hit.found ? off_the_face(hit, from, unit_or_zero(way)) : from + share * way, hit};
    };
    rest.settled = rest.reached_side = false;
    dvec3 last_residual(0.0), last_step(0.0);
    for (int i = 0; i < kMostSteps && rest.touching && !surface.is_spent(); ++i) {
        const dvec3 n = rest.shaded_normal, d = goal - rest.curved;
        const double depth = -glm::dot(d, n);
        const dvec3 residual = d + depth * n;
        if (depth <= 0.0) {
            rest.touching = glm::length(d) > 2.0 * surface.bulge_mm;
            if (!rest.touching)
                rest.curved = goal;
            rest.reached_side = false;
            break;
        }
        if (glm::length(residual) < kConverged_mm) {
            rest.settled = true;
            rest.reached_side = false;
            break;
        }
        // The step that the last one's success suggests (Barzilai & Borwein 1988).
        double gain = 1.0;
        if (last_step != dvec3(0.0)) {
            const double change = glm::dot(last_step, last_residual - residual);
            gain = change > 1e-18 ? std::clamp(glm::dot(last_step, last_step) / change, 0.1, 3.0)
                                  : 0.5;
        }
        dvec3 step = gain * residual;
        step *= std::min(1.0, 0.5 * grain_mm / glm::length(step));
        // Up, along and down again: what is in the way of a leg ends it.
        const double length = glm::length(step), lift = 0.5 * length;
        const dvec3 raised = leg(rest.point, lift * n).end;
        const dvec3 along = leg(raised, step).end;
        const Leg down = leg(along, -(lift + length) * n);
        if (!down.hit.found)
            break; // over an edge: the facets themselves hold it
        const Rest next = touching_at(down.end, down.hit);
        last_residual = residual;
        last_step = next.curved - rest.curved;
        rest.point = next.point;
        rest.curved = next.curved;
        rest.face_normal = next.face_normal;
        rest.shaded_normal = next.shaded_normal;
        if (glm::length(last_step) < 0.1 * kConverged_mm)
            break;
    }
    return rest;
}

} // namespace palpate::haptics
