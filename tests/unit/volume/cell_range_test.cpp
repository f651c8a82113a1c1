#include "engine/volume/cell_range.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

// Values without order, and now and then a sample without data.
double hashed_with_gaps(glm::uvec3 i) {
    const uint32_t h = (i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u) * 2654435761u;
    return h % 997 == 0 ? kGap : static_cast<double>(h % 4001) - 1000.0;
}
double without_gaps(glm::uvec3 i) {
    const double value = hashed_with_gaps(i);
    return std::isnan(value) ? 0.0 : value;
}

// The same by the definition: each cell's samples one by one.
CellRanges by_definition(const Volume& volume, uint32_t side) {
    CellRanges ranges;
    ranges.side = side;
    for (int axis = 0; axis < 3; ++axis)
        ranges.count[axis] = std::max(1u, (volume.size()[axis] - 1 + side - 1) / side);
    for (uint32_t z = 0; z < ranges.count.z; ++z)
        for (uint32_t y = 0; y < ranges.count.y; ++y)
            for (uint32_t x = 0; x < ranges.count.x; ++x) {
                ValueRange range;
                bool gap = false;
                const glm::uvec3 first = glm::uvec3(x, y, z) * side;
                const glm::uvec3 last = glm::min(first + side, volume.size() - 1u);
                for (uint32_t k = first.z; k <= last.z; ++k)
                    for (uint32_t j = first.y; j <= last.y; ++j)
                        for (uint32_t i = first.x; i <= last.x; ++i) {
                            const float value = volume.value({i, j, k});
                            if (std::isnan(value))
                                gap = true;
                            else
                                range.include(value);
                        }
                ranges.low.push_back(range.min);
                ranges.high.push_back(range.max);
                if (volume.no_data_count() > 0)
                    ranges.gaps.push_back(gap);
            }
    return ranges;
}

void expect_same(const CellRanges& a, const CellRanges& b) {
    EXPECT_EQ(a.side, b.side);
    EXPECT_EQ(a.count, b.count);
    EXPECT_EQ(a.low, b.low);
    EXPECT_EQ(a.high, b.high);
    EXPECT_EQ(a.gaps, b.gaps);
}

TEST(CellRanges, AreThoseOfTheirSamples) {
    for (const glm::uvec3 size : {glm::uvec3(70, 33, 65), {64, 1, 9}, {1, 1, 1}, {9, 8, 33}})
        for (const uint32_t side : {4u, 8u}) {
            const Volume odd =
                make_volume(make_grid(size, glm::dvec3(1.0)), ScalarType::f32, hashed_with_gaps);
            expect_same(make_cell_ranges(odd, side), by_definition(odd, side));
            const Volume full =
                make_volume(make_grid(size, glm::dvec3(1.0)), ScalarType::i16, without_gaps);
            expect_same(make_cell_ranges(full, side), by_definition(full, side));
        }
}

TEST(CellRanges, AfterEditsAreThoseOfTheNewSnapshot) {
    Volume volume =
        make_volume(make_grid({70, 45, 65}, glm::dvec3(1.0)), ScalarType::f32, without_gaps);
    CellRanges ranges = make_cell_ranges(volume, 8);
    // On faces of cells, blocks and bricks, in the corners, and the first and the last gap.
    const std::pair<glm::uvec3, double> edits[] = {
        {{8, 8, 8}, 9000.0},    {{32, 31, 32}, -9000.0}, {{69, 44, 64}, 9000.0},
        {{0, 0, 0}, -9000.0},   {{31, 32, 63}, kGap},    {{40, 24, 16}, kGap},
        {{31, 32, 63}, 9000.0}, {{40, 24, 16}, 5.0},     {{64, 0, 7}, 12000.0}};
    for (const auto& [at, value] : edits) {
        VolumeEdit edit(volume);
        edit.set(at, value);
        const Volume next = edit.commit();
        update_cell_ranges(ranges, next, changed_bricks(volume, next));
        expect_same(ranges, by_definition(next, 8));
        volume = next;
    }
}

// Samples that lie elsewhere are not read: ranges are those of blocks, and hold what is there.
TEST(CellRanges, OfBricksInASourceAreThoseOfBlocks) {
    struct Nowhere : BrickSource {
        SamplesPtr fetch(uint64_t) const override { throw SourceError("was read"); }
    };
    const Grid grid = make_grid({90, 41, 64}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::f32, hashed_with_gaps);
    const auto nowhere = std::make_shared<Nowhere>();
    VolumeBuilder builder(grid, ScalarType::f32);
    for_each_brick(volume, [&](glm::uvec3 p) {
        const auto ranges = std::make_shared<BlockRanges>();
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
            (*ranges)[block] = volume.brick(p).block_range(block);
        builder.set_brick(
            p, Brick::in_source(nowhere, 0,
                                {ScalarType::f32, ranges, volume.brick(p).no_data_count()}));
    });
    const CellRanges exact = make_cell_ranges(volume, 8);
    const CellRanges wide = make_cell_ranges(builder.finish(), 8);
    ASSERT_EQ(wide.count, exact.count);
    for (size_t i = 0; i < exact.cells(); ++i) {
        ASSERT_LE(wide.low[i], exact.low[i]);
        ASSERT_GE(wide.high[i], exact.high[i]);
        ASSERT_GE(wide.gaps[i], exact.gaps[i]);
    }
    // The first cell: the blocks (0 .. 1)^3, samples 0 .. 15.
    ValueRange first;
    for (uint32_t z = 0; z < 16; ++z)
        for (uint32_t y = 0; y < 16; ++y)
            for (uint32_t x = 0; x < 16; ++x)
                if (const float value = volume.value({x, y, z}); value == value)
                    first.include(value);
    EXPECT_EQ(wide.low[0], first.min);
    EXPECT_EQ(wide.high[0], first.max);
}

} // namespace
} // namespace palpate
