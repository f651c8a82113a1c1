#include "engine/decode/affine.h"

#include <cmath>

namespace palpate::io {

namespace {

// Below this, rounding of 32-bit header fields can no longer be told from three axes in one plane.
constexpr double kLeastDeterminant = 1e-6; // of the unit step vectors

bool all_finite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Gives axis `axis` the unit normal of the two others, or any unit vector not in line with them.
void complete(glm::dmat3& steps, int axis) {
    const glm::dvec3 a = steps[(axis + 1) % 3];
    const glm::dvec3 b = steps[(axis + 2) % 3];
    glm::dvec3 normal = glm::cross(a, b);
    if (glm::length(normal) == 0) {
        const glm::dvec3 only = glm::length(a) > 0 ? a : b;
        glm::dvec3 aside(0);
        aside[axis] = 1;
        normal = aside;
        if (const double squared = glm::dot(only, only); squared > 0)
            normal -= only * (glm::dot(only, aside) / squared);
        if (glm::length(normal) < 0.1) { // the axis itself is taken: the next one is free
            aside = glm::dvec3(0);
            aside[(axis + 1) % 3] = 1;
            normal = aside - only * (glm::dot(only, aside) / glm::dot(only, only));
        }
    }
    steps[axis] = glm::normalize(normal);
}

} // namespace

Result<Grid> grid_from_columns(const std::string& name, glm::uvec3 size, glm::dmat3 steps,
                               glm::dvec3 origin, glm::dvec3 axes) {
    if (!all_finite(steps[0]) || !all_finite(steps[1]) || !all_finite(steps[2]) ||
        !all_finite(origin))
        return fail("{}: its position matrix holds numbers that are not finite", name);
    for (int axis = 0; axis < 3; ++axis)
        if (size[axis] == 1 && glm::length(steps[axis]) == 0)
            complete(steps, axis);
    glm::dmat3 unit = steps;
    for (int axis = 0; axis < 3; ++axis) {
        const double length = glm::length(steps[axis]);
        if (!(length > 0) || !std::isfinite(length))
            return fail(
                "{}: expected a distance between samples above 0 mm along axis {}, found "
                "{}",
                name, "xyz"[axis], length);
        unit[axis] /= length;
    }
    if (const double found = std::abs(glm::determinant(unit)); !(found > kLeastDeterminant))
        return fail("{}: its position matrix has axes that lie in one plane (determinant {:.3g})",
                    name, found);
    Grid grid;
    grid.size = size;
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis] = glm::dvec4(steps[axis] * axes, 0);
    grid.world_from_index[3] = glm::dvec4(origin * axes, 1);
    // -0.0 * 1 stays -0.0; adding 0 makes it 0, so that equal positions are equal bits.
    grid.world_from_index = grid.world_from_index + glm::dmat4(0.0);
    return grid;
}

} // namespace palpate::io
