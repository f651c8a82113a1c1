#pragma once

#include <array>
#include <glm/glm.hpp>

#include "engine/surface/net_cell.h"
#include "engine/volume/volume.h"

namespace palpate {

// Tells what surface_nets() makes of a block of 8^3 cells, without making it. Block (0, 0, 0)
// begins with cell (0, 0, 0); cell c lies between the samples c - 1 and c. A block has the vertices
// of its cells, and of each cell the walls between its lowest corner and the ones beyond it on the
// axes.
class NetCounter {
 public:
    struct Count {
        uint32_t vertices = 0;
        uint32_t more_vertices =
            0; // of walls with split sides: their middles, and one for each side
        uint32_t triangles = 0;
    };
    Count count(const Volume& labels, glm::ivec3 block);

 private:
    static constexpr int kSide = 10, kCells = 9; // samples, and cells from the one before the block
    std::array<uint16_t, kSide * kSide * kSide> labels_;
    std::array<NetCell, kCells * kCells * kCells> cells_;
};

} // namespace palpate
