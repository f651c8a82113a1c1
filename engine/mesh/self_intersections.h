#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "engine/mesh/mesh.h"

namespace palpate {

// Pairs of triangles of a mesh that have a point in common which is not a vertex or an edge that
// both name; the lesser number first, pairs in rising order.
//
// Conservative: a pair that is left out is disjoint beyond doubt, whatever the rounding. Triangles
// that touch, or come nearer than the rounding of a volume of four points in double (about 1e-15 of
// the product of their extents), may be listed. Vertices are the same where their index is the
// same: weld() first where positions should count. Triangles that name a vertex twice are left out.
// Time is about that of the pairs whose boxes overlap, found by a grid.
std::vector<std::pair<uint32_t, uint32_t>> self_intersections(const Mesh& mesh);

} // namespace palpate
