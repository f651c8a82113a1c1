#include "engine/volume/cell_range.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A NaN leaves both as they are: every comparison with it is false.
void include(float& low, float& high, float value) {
    low = value < low ? value : low;
    high = value > high ? value : high;
}

// A box of cells: [first, end).
struct CellBox {
    glm::uvec3 first, end;
};

// Recomputes one layer (z) of the cells of a box.
void fill_layer(CellRanges& ranges, const Volume& volume, const CellBox& box, uint32_t z) {
    const uint32_t side = ranges.side;
    const glm::uvec3 last = volume.size() - 1u;
    const uint32_t x0 = box.first.x * side;
    const uint32_t x1 = std::min(box.end.x * side, last.x);
    const uint32_t cells = box.end.x - box.first.x;
    std::vector<float> row(x1 - x0 + 1), low(cells), high(cells);
    std::vector<uint8_t> gap(ranges.gaps.empty() ? 0 : cells);
    for (uint32_t cy = box.first.y; cy < box.end.y; ++cy)
        for (uint32_t cx = box.first.x; cx < box.end.x; ++cx) {
            const size_t cell = cx + ranges.count.x * (cy + size_t{ranges.count.y} * z);
            ranges.low[cell] = kInfinity;
            ranges.high[cell] = -kInfinity;
            if (!ranges.gaps.empty())
                ranges.gaps[cell] = 0;
        }
    const uint32_t y1 = std::min(box.end.y * side, last.y);
    for (uint32_t sz = z * side; sz <= std::min((z + 1) * side, last.z); ++sz)
        for (uint32_t sy = box.first.y * side; sy <= y1; ++sy) {
            read_row(volume, {x0, sy, sz}, static_cast<uint32_t>(row.size()), row.data());
            for (uint32_t c = 0; c < cells; ++c) {
                low[c] = kInfinity;
                high[c] = -kInfinity;
                const size_t end = std::min<size_t>(size_t{c + 1} * side + 1, row.size());
                for (size_t i = size_t{c} * side; i < end; ++i)
                    include(low[c], high[c], row[i]);
                if (!gap.empty())
                    gap[c] = std::any_of(row.begin() + c * side, row.begin() + end,
                                         [](float v) { return v != v; });
            }
            // A row between two cells belongs to both.
            const uint32_t upper = std::min(sy / side, box.end.y - 1);
            const uint32_t lower =
                sy % side == 0 && sy / side > box.first.y ? sy / side - 1 : upper;
            for (uint32_t cy = lower; cy <= upper; ++cy) {
                const size_t first =
                    box.first.x + ranges.count.x * (cy + size_t{ranges.count.y} * z);
                for (uint32_t c = 0; c < cells; ++c) {
                    ranges.low[first + c] = std::min(ranges.low[first + c], low[c]);
                    ranges.high[first + c] = std::max(ranges.high[first + c], high[c]);
                    if (!gap.empty())
                        ranges.gaps[first + c] |= gap[c];
                }
            }
        }
}

bool is_in_source(const Volume& volume) {
    bool in_source = false;
    for_each_brick(volume,
                   [&](glm::uvec3 p) { in_source = in_source || volume.brick(p).is_in_source(); });
    return in_source;
}

// Each cell from the blocks that it touches. A gap anywhere in a brick counts for all of it.
void fill_from_blocks(CellRanges& ranges, const Volume& volume) {
    const uint32_t per_cell = ranges.side / kBlockSide;
    const glm::uvec3 blocks = (volume.size() + (kBlockSide - 1)) / kBlockSide;
    tbb::parallel_for(uint32_t{0}, ranges.count.z, [&](uint32_t z) {
        for (uint32_t y = 0; y < ranges.count.y; ++y)
            for (uint32_t x = 0; x < ranges.count.x; ++x) {
                const glm::uvec3 low = glm::uvec3(x, y, z) * per_cell;
                const glm::uvec3 high = glm::min(low + per_cell, blocks - 1u); // included
                ValueRange range;
                bool gap = false;
                for (uint32_t k = low.z; k <= high.z; ++k)
                    for (uint32_t j = low.y; j <= high.y; ++j)
                        for (uint32_t i = low.x; i <= high.x; ++i) {
                            const glm::uvec3 block(i, j, k);
                            const Brick& brick = volume.brick(block / kBlocksPerSide);
                            range.include(
                                brick.block_range(block_of(block % kBlocksPerSide * kBlockSide)));
                            gap = gap || brick.no_data_count() > 0;
                        }
                const size_t cell = x + ranges.count.x * (y + size_t{ranges.count.y} * z);
                ranges.low[cell] = range.min;
                ranges.high[cell] = range.max;
                if (!ranges.gaps.empty())
                    ranges.gaps[cell] = gap;
            }
    });
}

void fill(CellRanges& ranges, const Volume& volume, const CellBox& box) {
    tbb::parallel_for(box.first.z, box.end.z,
                      [&](uint32_t z) { fill_layer(ranges, volume, box, z); });
}

} // namespace

uint32_t cell_side_for(glm::uvec3 size) {
    return uint64_t{size.x} * size.y * size.z > 320ull * 320 * 320 ? 8 : 4;
}

CellRanges make_cell_ranges(const Volume& volume, uint32_t side) {
    PALPATE_ASSERT_CMP(side, >=, 1u);
    CellRanges ranges;
    ranges.side = side;
    ranges.count = glm::max((volume.size() - 1u + (side - 1)) / side, glm::uvec3(1));
    ranges.low.resize(ranges.cells());
    ranges.high.resize(ranges.cells());
    if (volume.no_data_count() > 0)
        ranges.gaps.resize(ranges.cells());
    if (side % kBlockSide == 0 && is_in_source(volume))
        fill_from_blocks(ranges, volume);
    else
        fill(ranges, volume, {glm::uvec3(0), ranges.count});
    return ranges;
}

void update_cell_ranges(CellRanges& ranges, const Volume& volume,
                        std::span<const ChangedBrick> changed) {
    if (volume.no_data_count() == 0) // gone with the last gap
        ranges.gaps.clear();
    else if (ranges.gaps.empty()) // all of them lie where the edit was
        ranges.gaps.resize(ranges.cells());
    for (const ChangedBrick& brick : changed) {
        glm::uvec3 low(kBrickSide), high(0); // samples of the brick that may have changed
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
            if (brick.blocks >> block & 1) {
                const glm::uvec3 at(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                    block / (kBlocksPerSide * kBlocksPerSide));
                low = glm::min(low, at * kBlockSide);
                high = glm::max(high, at * kBlockSide + (kBlockSide - 1));
            }
        const glm::uvec3 first = brick.position * kBrickSide + low;
        const glm::uvec3 last = glm::min(brick.position * kBrickSide + high, volume.size() - 1u);
        // The cell below reads the first sample, too.
        const glm::uvec3 below = glm::max(first, glm::uvec3(1)) - 1u;
        fill(ranges, volume,
             {glm::min(below / ranges.side, ranges.count - 1u),
              glm::min(last / ranges.side + 1u, ranges.count)});
    }
}

} // namespace palpate
