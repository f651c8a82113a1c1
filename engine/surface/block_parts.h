#pragma once

#include "engine/surface/block_cells.h"

// Helpers for the vertices and triangles of a block; for block_*.cpp alone.
namespace palpate::block {

// From the number of a cell's first edge (its lowest corner's, axis 0) to those of its twelve.
const std::array<uint16_t, 12>& edge_differences();

// The samples at the corners of the cell whose lowest corner starts this edge.
inline std::array<float, 8> corners_of(const Samples& samples, int first_edge) {
    const float* low = samples.value.data() + first_edge / 4;
    std::array<float, 8> corners;
    for (int c = 0; c < 8; ++c)
        corners[c] = low[(c & 1) + 12 * (c >> 1 & 1) + 132 * (c >> 2 & 1)];
    return corners;
}

struct Crossing {
    glm::vec3 position; // samples of the volume
    glm::vec3 normal;
};

// A vertex within a cell: against the interpolant's gradient there, or where a corner is missing
// against that of the edges. scale is 0.5 / spacing.
Crossing inner_crossing(const InnerVertex& inner, const Samples& samples, glm::ivec3 cell,
                        glm::ivec3 origin, float iso, glm::vec3 scale);

} // namespace palpate::block
