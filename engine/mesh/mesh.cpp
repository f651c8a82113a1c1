#include "engine/mesh/mesh.h"

#include <glm/gtc/matrix_transform.hpp>
#include <utility>

#include "engine/base/assert.h"
#include "engine/mesh/used_positions.h"

namespace palpate {

glm::dmat4 world_from_mesh(const Grid& grid) {
    return glm::scale(grid.world_from_index, 1.0 / spacing_mm(grid));
}

Mesh surface_of_label(const Mesh& mesh, uint16_t label) {
    PALPATE_ASSERT_CMP(mesh.labels.size(), ==, mesh.triangles.size());
    Mesh surface{.world_from_mesh = mesh.world_from_mesh};
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        glm::uvec3 t = mesh.triangles[n];
        if (mesh.labels[n] != label) {
            if (mesh.outer_labels.empty() || mesh.outer_labels[n] != label)
                continue;
            std::swap(t.y, t.z);
        }
        surface.triangles.push_back(t);
    }
    surface.labels.assign(surface.triangles.size(), label);
    std::vector<uint32_t> renamed;
    take_used_positions(mesh, surface, renamed);
    return surface;
}

} // namespace palpate
