#include "engine/volume/grid.h"

namespace palpate {

Grid make_grid(glm::uvec3 size, glm::dvec3 spacing_mm, glm::dvec3 origin_mm) {
    Grid grid;
    grid.size = size;
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis][axis] = spacing_mm[axis];
    grid.world_from_index[3] = glm::dvec4(origin_mm, 1.0);
    return grid;
}

glm::dvec3 spacing_mm(const Grid& grid) {
    const glm::dmat4& m = grid.world_from_index;
    return {glm::length(glm::dvec3(m[0])), glm::length(glm::dvec3(m[1])),
            glm::length(glm::dvec3(m[2]))};
}

glm::dmat4 index_from_world(const Grid& grid) {
    // The linear part is inverted apart from the origin, so that a far origin costs no digits.
    const glm::dmat3 inverse = glm::inverse(glm::dmat3(grid.world_from_index));
    glm::dmat4 result(inverse);
    result[3] = glm::dvec4(-(inverse * glm::dvec3(grid.world_from_index[3])), 1.0);
    return result;
}

glm::dvec3 world_point(const Grid& grid, glm::dvec3 index) {
    return glm::dmat3(grid.world_from_index) * index + glm::dvec3(grid.world_from_index[3]);
}

glm::dvec3 index_point(const Grid& grid, glm::dvec3 world_mm) {
    return glm::inverse(glm::dmat3(grid.world_from_index)) *
           (world_mm - glm::dvec3(grid.world_from_index[3]));
}

glm::dvec3 center_mm(const Grid& grid) {
    return world_point(grid, 0.5 * (glm::dvec3(grid.size) - 1.0));
}

glm::dvec3 world_gradient(const Grid& grid, glm::dvec3 gradient_index) {
    return glm::transpose(glm::inverse(glm::dmat3(grid.world_from_index))) * gradient_index;
}

} // namespace palpate
