#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/volume/grid.h"

namespace palpate {

// Triangles that share vertices.
//
// Mesh space is millimetres; `world_from_mesh` places it in the patient and holds what floats
// cannot: offsets of kilometres and directions. A mesh taken from a volume has the volume's index
// axes, scaled to millimetres (world_from_mesh(grid)).
struct Mesh {
    std::vector<glm::vec3> positions;  // mm, mesh space
    std::vector<glm::vec3> normals;    // unit length, outward, mesh space; none, or one a position
    std::vector<glm::uvec3> triangles; // counter-clockwise seen from outside, where values are low
    std::vector<uint16_t> labels;      // what each triangle encloses; none, or one a triangle
    glm::dmat4 world_from_mesh{1};     // affine, invertible, keeps handedness or mirrors it
};

// Where the mesh of a volume lies: mesh = index * spacing_mm(grid), axis by axis. Rigid, unless
// the grid is sheared.
glm::dmat4 world_from_mesh(const Grid& grid);

} // namespace palpate
