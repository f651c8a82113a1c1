#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/volume/changes.h"
#include "engine/volume/volume.h"

namespace palpate {

// The lowest and highest value that trilinear interpolation takes within each macro-cell.
//
// Macro-cell (i, j, k) covers index positions [i, i + 1] * side on each axis, both ends included,
// so neighbours share a layer of samples. Cells are stored x fastest. No-data is left out: a cell
// without any data has an empty range (low > high). In a cell with some of both, trilinear
// interpolation gives NaN in places.
struct CellRanges {
    uint32_t side = 8;         // samples from one face of a cell to the opposite one; >= 1
    glm::uvec3 count{1};       // cells on each axis: (size - 1) / side rounded up, at least 1
    std::vector<float> low;    // one a cell; +infinity where there is no data
    std::vector<float> high;   // one a cell; -infinity where there is no data
    std::vector<uint8_t> gaps; // one a cell: 1 where a sample has no data; none if all have

    size_t cells() const { return size_t{count.x} * count.y * count.z; }
};

// The fastest side of cells: 4 up to about 256^3 samples, 8 beyond.
uint32_t cell_side_for(glm::uvec3 size);

// Reads every sample once or twice, on all cores. Where bricks keep their samples in a source and
// side is a multiple of a block's, the ranges of blocks serve, and nothing is read: a cell takes
// the blocks above it whole, though it shares but a layer of samples with them, so that its range
// may be wider than need be.
CellRanges make_cell_ranges(const Volume& volume, uint32_t side);

// Brings `ranges` of an earlier snapshot up to `volume`: reads the cells that touch a changed
// block. Gives what make_cell_ranges(volume, ranges.side) gives, or narrower ranges where those
// came from whole blocks.
void update_cell_ranges(CellRanges& ranges, const Volume& volume,
                        std::span<const ChangedBrick> changed);

} // namespace palpate
