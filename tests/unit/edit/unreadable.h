#pragma once

#include "engine/volume/brick_source.h"
#include "engine/volume/builder.h"

namespace palpate {

// Two bricks of labels along x; the samples of the second lie in a file that was cut meanwhile.
inline Volume unreadable_volume() {
    struct Cut : BrickSource {
        SamplesPtr fetch(uint64_t) const override { throw SourceError("the file was cut"); }
    };
    const Grid grid = make_grid({64, 32, 32}, glm::dvec3(1));
    const auto value = [](glm::uvec3 i) { return double(i.x % 3); };
    const Volume readable = make_volume(grid, ScalarType::u8, value);
    const auto ranges = std::make_shared<BlockRanges>();
    for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
        (*ranges)[block] = readable.brick({1, 0, 0}).block_range(block);
    VolumeBuilder builder(grid, ScalarType::u8);
    builder.set_brick({0, 0, 0}, readable.brick_ptr({0, 0, 0}));
    builder.set_brick({1, 0, 0},
                      Brick::in_source(std::make_shared<Cut>(), 0, {ScalarType::u8, ranges, 0}));
    return builder.finish();
}

} // namespace palpate
