#include "engine/reference/surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/assert.h"

namespace palpate::reference {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

bool comes_before(glm::dvec3 a, glm::dvec3 b) {
    return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
}

} // namespace

Marched SurfaceHit::marched() const {
    Marched seen;
    seen.add(color, opacity);
    seen.value = value;
    seen.depth = t;
    return seen;
}

Surfaces::Surfaces(const Scene& scene, const SceneData& data, const Rays& rays)
    : scene_(scene), data_(data), rays_(rays) {
    for (uint32_t mesh = 0; mesh < data.meshes.size(); ++mesh)
        add_mesh(mesh);
}

void Surfaces::add_mesh(uint32_t number) {
    PALPATE_ASSERT(data_.meshes[number] != nullptr);
    const Mesh& mesh = *data_.meshes[number];
    const glm::dmat3 turn(mesh.world_from_mesh);
    const glm::dvec3 origin = rays_.local_point(glm::dvec3(mesh.world_from_mesh[3]));
    mirrored_.push_back(glm::determinant(turn) < 0.0);
    const auto shown = [](uint16_t label) { return label > 0; };
    labelled_.push_back(std::any_of(mesh.labels.begin(), mesh.labels.end(), shown) ||
                        std::any_of(mesh.outer_labels.begin(), mesh.outer_labels.end(), shown));
    covector_from_mesh_.push_back(glm::transpose(glm::inverse(turn)));
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const uint32_t label = mesh.labels.empty() ? 0 : mesh.labels[i];
        const uint32_t outer = mesh.outer_labels.empty() ? 0 : mesh.outer_labels[i];
        // Those that are not shown count for caps where labels add up across walls.
        if (mesh.outer_labels.empty() && !(style(number, label).opacity > 0.0))
            continue;
        std::array<glm::dvec3, 3> corners;
        for (int k = 0; k < 3; ++k)
            corners[k] = turn * glm::dvec3(mesh.positions[mesh.triangles[i][k]]) + origin;
        int swaps = 0;
        for (const auto& [j, k] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
            if (comes_before(corners[k], corners[j])) {
                std::swap(corners[j], corners[k]);
                ++swaps;
            }
        const glm::dvec3 center = (corners[0] + corners[1] + corners[2]) / 3.0;
        double radius = 0.0;
        for (const glm::dvec3 corner : corners)
            radius = std::max(radius, glm::length(corner - center));
        radius *= 1.0 + 1e-9;
        triangles_.push_back({corners[0], corners[1], corners[2], center, radius * radius,
                              swaps % 2 == 1, number, i, label, outer});
    }
}

SurfaceStyle Surfaces::style(uint32_t mesh, uint32_t label) const {
    SurfaceStyle style = style_of(scene_.surfaces[mesh], label);
    if (label == 0 && labelled_[mesh]) // background
        style.opacity = 0.0;
    return style;
}

// Moeller and Trumbore 1997, in double.
std::optional<Surfaces::Crossing> Surfaces::cross(const LocalRay& ray,
                                                  const Triangle& triangle) const {
    const glm::dvec3 arm = triangle.center - ray.origin_mm;
    const double along = glm::dot(arm, ray.direction);
    if (glm::dot(arm, arm) - along * along > triangle.radius_squared + 1e-9 * glm::dot(arm, arm))
        return std::nullopt;
    const glm::dvec3 ab = triangle.b - triangle.a, ac = triangle.c - triangle.a;
    const glm::dvec3 p = glm::cross(ray.direction, ac);
    const double determinant = glm::dot(ab, p);
    if (determinant == 0.0)
        return std::nullopt;
    const glm::dvec3 from = ray.origin_mm - triangle.a;
    const glm::dvec3 q = glm::cross(from, ab);
    const double v = glm::dot(from, p) / determinant;
    const double w = glm::dot(ray.direction, q) / determinant;
    const double t = glm::dot(ac, q) / determinant;
    if (v < 0.0 || w < 0.0 || v + w > 1.0 || !(t > 0.0))
        return std::nullopt;
    // The determinant is -(normal of a, b, c) * direction.
    const bool turned = triangle.swapped != mirrored_[triangle.mesh];
    const bool leaving = (determinant < 0.0) != turned;
    return Crossing{t, leaving, &triangle};
}

SurfaceHit Surfaces::seen(const LocalRay& ray, const Crossing& crossing) const {
    const Triangle& triangle = *crossing.triangle;
    const SurfaceLayer& layer = scene_.surfaces[triangle.mesh];
    const Mesh& mesh = *data_.meshes[triangle.mesh];
    glm::dvec3 normal = glm::cross(triangle.b - triangle.a, triangle.c - triangle.a);
    if (layer.smooth && !mesh.normals.empty()) {
        // Weights by areas: those that the point makes with each edge of the triangle as listed.
        const glm::dmat3 turn(mesh.world_from_mesh);
        const glm::dvec3 origin = rays_.local_point(glm::dvec3(mesh.world_from_mesh[3]));
        const glm::dvec3 point = ray.origin_mm + crossing.t * ray.direction;
        const glm::uvec3 corners = mesh.triangles[triangle.number];
        const auto at = [&](int k) {
            return turn * glm::dvec3(mesh.positions[corners[k]]) + origin - point;
        };
        glm::dvec3 blended(0.0);
        for (int k = 0; k < 3; ++k)
            blended += glm::dot(normal, glm::cross(at((k + 1) % 3), at((k + 2) % 3))) *
                       glm::dvec3(mesh.normals[corners[k]]);
        if (glm::length(blended) > 0.0)
            normal = covector_from_mesh_[triangle.mesh] * blended;
    }
    // The label that the ray enters, or, where it is not shown, the one that it leaves.
    uint32_t label = crossing.leaving ? triangle.outer : triangle.label;
    if (!(style(triangle.mesh, label).opacity > 0.0))
        label = crossing.leaving ? triangle.label : triangle.outer;
    const SurfaceStyle seen_in = style(triangle.mesh, label);
    const double facing = std::min(1.0, std::abs(glm::dot(glm::normalize(normal), ray.direction)));
    return {crossing.t, Sampler::lit(layer.shading, seen_in.color, facing), seen_in.opacity,
            labelled_[triangle.mesh] ? label : kNothing};
}

// A cap at distance t, of the last mesh that encloses the point there: behind it, a ray leaves what
// a closed mesh encloses once more often than it enters it.
void Surfaces::add_cap(const LocalRay& ray, double t, glm::dvec3 normal,
                       const std::vector<Crossing>& crossings,
                       std::vector<SurfaceHit>& hits) const {
    for (size_t mesh = data_.meshes.size(); mesh-- > 0;) {
        const bool labelled = labelled_[mesh];
        int64_t inside = 0;
        for (const Crossing& crossing : crossings) {
            const Triangle& triangle = *crossing.triangle;
            const int64_t weight = labelled ? int64_t{triangle.label} - int64_t{triangle.outer} : 1;
            if (triangle.mesh == mesh && crossing.t > t)
                inside += crossing.leaving ? weight : -weight;
        }
        if (inside <= 0)
            continue;
        const SurfaceLayer& layer = scene_.surfaces[mesh];
        const SurfaceStyle shown =
            style(static_cast<uint32_t>(mesh), labelled ? static_cast<uint32_t>(inside) : 0);
        const double facing = std::abs(glm::dot(glm::normalize(normal), ray.direction));
        hits.push_back({t, Sampler::lit(layer.shading, shown.color, facing), shown.opacity,
                        labelled ? static_cast<double>(inside) : kNothing});
        return;
    }
}

SurfaceHits Surfaces::along(const LocalRay& ray) const {
    std::vector<Crossing> crossings;
    for (const Triangle& triangle : triangles_)
        if (const auto crossing = cross(ray, triangle))
            crossings.push_back(*crossing);
    std::stable_sort(crossings.begin(), crossings.end(),
                     [](const Crossing& a, const Crossing& b) { return a.t < b.t; });

    double from = 0.0, to = kInfinity;
    glm::dvec3 from_normal(0.0), to_normal(0.0);
    for (const ClipPlane& plane : scene_.clip_planes) {
        const double rate = glm::dot(plane.normal, ray.direction);
        const double start =
            glm::dot(plane.normal, ray.origin_mm - rays_.local_point(plane.point_mm));
        if (rate == 0.0 && start < 0.0)
            return {};
        if (rate > 0.0 && -start / rate > from) {
            from = -start / rate;
            from_normal = plane.normal;
        } else if (rate < 0.0 && -start / rate < to) {
            to = -start / rate;
            to_normal = plane.normal;
        }
    }
    if (from > to)
        return {};
    std::vector<SurfaceHit> hits;
    if (from > 0.0)
        add_cap(ray, from, from_normal, crossings, hits);
    for (const Crossing& crossing : crossings)
        if (crossing.t >= from && crossing.t <= to)
            hits.push_back(seen(ray, crossing));
    if (to > 0.0 && to < kInfinity)
        add_cap(ray, to, to_normal, crossings, hits);

    SurfaceHits met;
    for (const SurfaceHit& hit : hits)
        if (hit.opacity >= 1.0 && (!met.opaque || hit.t < met.opaque->t))
            met.opaque = hit;
    for (const SurfaceHit& hit : hits)
        if (hit.opacity > 0.0 && hit.opacity < 1.0 && (!met.opaque || hit.t < met.opaque->t) &&
            met.see_through.size() < scene_.surface_depth)
            met.see_through.push_back(hit);
    return met;
}

} // namespace palpate::reference
