#include "engine/mesh/collapse_source.h"

#include <map>

#include "engine/mesh/used_positions.h"

namespace palpate {

CollapseSource::CollapseSource(const Mesh& whole)
    : mesh(whole), incident(triangles_of_vertices(whole)) {
    const glm::dmat3 linear(mesh.world_from_mesh);
    const glm::dvec3 centre(mesh.positions.empty() ? glm::vec3(0.0f) : mesh.positions[0]);
    local_from_mesh = glm::dmat4(linear);
    local_from_mesh[3] = glm::dvec4(-(linear * centre), 1.0);
    points.reserve(mesh.positions.size());
    for (const glm::vec3 p : mesh.positions)
        points.emplace_back(local_from_mesh * glm::dvec4(glm::dvec3(p), 1.0));
    std::map<std::pair<uint16_t, uint16_t>, uint32_t> numbers;
    double sum = 0.0;
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const std::pair<uint16_t, uint16_t> key{
            mesh.labels.empty() ? 0 : mesh.labels[n],
            mesh.outer_labels.empty() ? 0 : mesh.outer_labels[n]};
        const auto [at, is_new] = numbers.try_emplace(key, static_cast<uint32_t>(numbers.size()));
        if (is_new)
            triangles_of_patch.emplace_back();
        patch.push_back(at->second);
        const glm::uvec3 t = mesh.triangles[n];
        if (t.x != t.y && t.y != t.z && t.z != t.x) // else a line, and no part of the surface
            triangles_of_patch[at->second].push_back(static_cast<uint32_t>(n));
        sum += glm::length(points[t.x] - points[t.y]) + glm::length(points[t.y] - points[t.z]) +
               glm::length(points[t.z] - points[t.x]);
    }
    edge_mm = mesh.triangles.empty() ? 0.0 : sum / (3.0 * double(mesh.triangles.size()));
    std::vector<uint32_t> renamed;
    for (const std::vector<uint32_t>& chosen : triangles_of_patch) {
        Mesh part{.world_from_mesh = local_from_mesh};
        for (const uint32_t n : chosen)
            part.triangles.push_back(mesh.triangles[n]);
        take_used_positions(mesh, part, renamed);
        trees.emplace_back(part);
    }
}

} // namespace palpate
