#pragma once

#include <array>

#include "engine/surface/block_cells.h"

namespace palpate::block {

// Tells how much BlockMesher::mesh() makes of a block in topology `classic`, at a small part of
// its cost. All its memory is there from the start.
class BlockCounter {
 public:
    BlockCounter();

    Samples& samples() { return samples_; } // to be filled before each count()

    struct Result {
        uint32_t own_edges = 0, borrowed = 0; // vertices
        uint32_t triangles = 0;
    };
    Result count(Last last, float iso);

 private:
    Samples samples_;
    Cells cells_;
    std::array<BorrowedEdge, kMostEdges> borrowed_;
};

} // namespace palpate::block
