#include "engine/mesh/mesh.h"

#include <glm/gtc/matrix_transform.hpp>

namespace palpate {

glm::dmat4 world_from_mesh(const Grid& grid) {
    return glm::scale(grid.world_from_index, 1.0 / spacing_mm(grid));
}

} // namespace palpate
