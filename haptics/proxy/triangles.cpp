#include "haptics/proxy/triangles.h"

#include <algorithm>
#include <cmath>

#include "haptics/proxy/coupling.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

struct Corners {
    dvec3 a, b, c;
};

Corners corners_of(const TriangleSpan& s, uint32_t t) {
    const glm::uvec3 v = s.triangles[t];
    return {dvec3(s.positions[v.x]), dvec3(s.positions[v.y]), dvec3(s.positions[v.z])};
}

// Barycentric weights of the point of a triangle nearest to p.
dvec3 nearest_weights(const Corners& k, dvec3 p) {
    const dvec3 ab = k.b - k.a, ac = k.c - k.a, ap = p - k.a;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0)
        return {1, 0, 0};
    const dvec3 bp = p - k.b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3)
        return {0, 1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        const double v = d1 > d3 ? d1 / (d1 - d3) : 0.0;
        return {1.0 - v, v, 0};
    }
    const dvec3 cp = p - k.c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6)
        return {0, 0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        const double w = d2 > d6 ? d2 / (d2 - d6) : 0.0;
        return {1.0 - w, 0, w};
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        const double sum = (d4 - d3) + (d5 - d6);
        const double w = sum > 0.0 ? (d4 - d3) / sum : 0.0;
        return {0, 1.0 - w, w};
    }
    const double all = va + vb + vc;
    return all > 0.0 ? dvec3(va, vb, vc) / all : dvec3(1, 0, 0);
}

SurfacePoint point_on(const TriangleSpan& s, uint32_t t, const Corners& k, dvec3 w) {
    SurfacePoint found{.point = w.x * k.a + w.y * k.b + w.z * k.c, .triangle = t, .found = true};
    found.face_normal = unit_or_zero(glm::cross(k.b - k.a, k.c - k.a));
    found.shaded_normal = found.face_normal;
    if (!s.normals.empty()) {
        const glm::uvec3 v = s.triangles[t];
        const dvec3 blended =
            unit_or_zero(w.x * dvec3(s.normals[v.x]) + w.y * dvec3(s.normals[v.y]) +
                         w.z * dvec3(s.normals[v.z]));
        if (glm::dot(blended, found.face_normal) > 0.0)
            found.shaded_normal = blended;
    }
    return found;
}

} // namespace

SurfacePoint nearest_point(const TriangleSpan& s, dvec3 p) {
    double best = INFINITY;
    uint32_t which = 0;
    dvec3 weights{};
    for (uint32_t t = 0; t < s.triangles.size(); ++t) {
        const Corners k = corners_of(s, t);
        const dvec3 w = nearest_weights(k, p);
        const dvec3 away = w.x * k.a + w.y * k.b + w.z * k.c - p;
        const double square = glm::dot(away, away);
        if (square < best) {
            best = square;
            which = t;
            weights = w;
        }
    }
    if (!std::isfinite(best))
        return {};
    SurfacePoint found = point_on(s, which, corners_of(s, which), weights);
    found.distance = std::sqrt(best);
    return found;
}

SurfacePoint first_crossing(const TriangleSpan& s, dvec3 from, dvec3 to) {
    // Moeller & Trumbore, with a margin of 1e-9 of the triangle about each edge.
    const dvec3 d = to - from;
    double best = 1.0;
    bool found = false;
    uint32_t which = 0;
    dvec3 weights{};
    for (uint32_t t = 0; t < s.triangles.size(); ++t) {
        const Corners k = corners_of(s, t);
        const dvec3 ab = k.b - k.a, ac = k.c - k.a;
        const dvec3 normal = glm::cross(ab, ac);
        const double det = -glm::dot(d, normal); // > 0 from outside
        if (!(det > 0.0))
            continue;
        const dvec3 ao = from - k.a, dao = glm::cross(ao, d);
        const double u = glm::dot(ac, dao) / det, v = -glm::dot(ab, dao) / det;
        const double at = glm::dot(ao, normal) / det;
        constexpr double kMargin = 1e-9;
        if (u < -kMargin || v < -kMargin || u + v > 1.0 + kMargin || at < 0.0 || at > best)
            continue;
        best = at;
        which = t;
        weights = {1.0 - u - v, u, v};
        found = true;
    }
    if (!found)
        return {};
    SurfacePoint hit = point_on(s, which, corners_of(s, which), weights);
    hit.distance = best * glm::length(d);
    return hit;
}

} // namespace palpate::haptics
