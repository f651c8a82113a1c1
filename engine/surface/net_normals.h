#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/mesh/mesh.h"

namespace palpate {

// Normals to shade the walls of surface_nets() with, one a vertex, in mesh space, of unit length or
// 0: towards the outer label. A vertex of walls between other labels, too, as on lines where walls
// meet, has none (0): a triangle is shaded there by its own normal.
//
// First the mean of a vertex's triangles, weighted by area; then, `rounds` times, the mean of its
// own and those of its neighbours. So the steps of samples do not show, which moving vertices
// within their cells leaves.
std::vector<glm::vec3> wall_normals(const Mesh& walls, uint32_t rounds);
// The same from these triangles alone, in rising order. Only normals of vertices that are more than
// rounds + 1 edges away from every other triangle are those of the whole mesh.
std::vector<glm::vec3> wall_normals(const Mesh& walls, uint32_t rounds,
                                    std::span<const uint32_t> triangles);

} // namespace palpate
