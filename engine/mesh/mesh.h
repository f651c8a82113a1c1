#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/volume/grid.h"

namespace palpate {

// Triangles that share vertices.
//
// Mesh space is millimetres; `world_from_mesh` places it in the patient and holds directions and
// offsets of kilometres, which floats cannot. A mesh taken from a volume has the volume's index
// axes, scaled to millimetres (world_from_mesh(grid)).
//
// A mesh with `outer_labels` has shared walls: where two labels meet, each triangle is there once,
// and counter-clockwise seen from the outer one. Those of several labels meet in lines, which is no
// fault; the surface of each label alone is closed (surface_of_label()).
struct Mesh {
    std::vector<glm::vec3> positions;   // mm, mesh space
    std::vector<glm::vec3> normals;     // unit length, outward, mesh space; none, or one a position
    std::vector<glm::uvec3> triangles;  // counter-clockwise seen from outside, where values are low
    std::vector<uint16_t> labels;       // what each triangle encloses; none, or one a triangle
    std::vector<uint16_t> outer_labels; // what lies on its other side; none, or one a triangle
    glm::dmat4 world_from_mesh{1};      // affine, invertible, keeps handedness or mirrors it
};

// The placement of a volume's mesh: mesh = index * spacing_mm(grid), axis by axis. Rigid, unless
// the grid is sheared.
glm::dmat4 world_from_mesh(const Grid& grid);

// The surface of one label: its triangles, and those of which it is the outer label, turned over.
// Positions (and normals) that these use keep their order; labels hold `label` alone.
Mesh surface_of_label(const Mesh& mesh, uint16_t label);

} // namespace palpate
