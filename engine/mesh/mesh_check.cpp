#include "engine/mesh/mesh_check.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace palpate {

Result<void> check_mesh(const Mesh& mesh) {
    const size_t vertices = mesh.positions.size(), triangles = mesh.triangles.size();
    for (const auto& [name, found, whole] : {std::tuple("normals", mesh.normals.size(), vertices),
                                             {"labels", mesh.labels.size(), triangles},
                                             {"outer labels", mesh.outer_labels.size(), triangles}})
        if (found != 0 && found != whole)
            return fail("a mesh: expected no {} or {}, found {}", name, whole, found);
    for (size_t v = 0; v < vertices; ++v)
        if (const glm::vec3 p = mesh.positions[v];
            !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
            return fail("a mesh: expected finite positions, found {} {} {} at vertex {}", p.x, p.y,
                        p.z, v);
    for (size_t n = 0; n < triangles; ++n)
        if (const glm::uvec3 t = mesh.triangles[n]; std::max({t.x, t.y, t.z}) >= vertices)
            return fail(
                "a mesh: expected triangles of its {} vertices, found {} {} {} at triangle {}",
                vertices, t.x, t.y, t.z, n);
    return {};
}

} // namespace palpate
