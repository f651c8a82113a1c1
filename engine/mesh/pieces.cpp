#include "engine/mesh/pieces.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/forest.h"
#include "engine/mesh/used_positions.h"

namespace palpate {

Pieces keep_pieces(const Mesh& mesh, const PieceChoice& choice) {
    Forest<std::vector<uint32_t>> joined{std::vector<uint32_t>(mesh.positions.size())};
    for (const glm::uvec3 t : mesh.triangles) {
        joined.join(t.x, t.y);
        joined.join(t.x, t.z);
    }
    // Six times the volume by the root of a piece, from the piece's own first vertex: places far
    // from the origin cost no digits.
    const glm::dmat3 linear(mesh.world_from_mesh);
    std::vector<double> volumes(mesh.positions.size(), 0.0);
    std::vector<uint32_t> roots;
    for (const glm::uvec3 t : mesh.triangles) {
        const uint32_t root = joined.root(t.x);
        if (volumes[root] == 0.0)
            roots.push_back(root);
        const glm::dvec3 from(mesh.positions[root]);
        const auto at = [&](uint32_t v) { return linear * (glm::dvec3(mesh.positions[v]) - from); };
        volumes[root] += glm::dot(at(t.x), glm::cross(at(t.y), at(t.z)));
    }
    std::sort(roots.begin(), roots.end());
    roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
    const double sign = glm::determinant(linear) < 0.0 ? -1.0 : 1.0; // mirrored: turned over
    uint32_t largest = roots.empty() ? 0 : roots.front();
    for (const uint32_t root : roots)
        if (sign * volumes[root] > sign * volumes[largest])
            largest = root;
    const auto stays = [&](uint32_t root) {
        return choice.largest_only ? root == largest
                                   : std::abs(volumes[root]) >= 6.0 * choice.least_mm3;
    };
    Pieces pieces{.mesh = {.world_from_mesh = mesh.world_from_mesh}};
    for (const uint32_t root : roots)
        ++(stays(root) ? pieces.kept : pieces.dropped);
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        if (!stays(joined.root(mesh.triangles[n].x)))
            continue;
        pieces.mesh.triangles.push_back(mesh.triangles[n]);
        if (!mesh.labels.empty())
            pieces.mesh.labels.push_back(mesh.labels[n]);
        if (!mesh.outer_labels.empty())
            pieces.mesh.outer_labels.push_back(mesh.outer_labels[n]);
    }
    std::vector<uint32_t> renamed;
    take_used_positions(mesh, pieces.mesh, renamed);
    return pieces;
}

} // namespace palpate
