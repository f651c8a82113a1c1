#include "engine/segment/brick_array.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/volume/grid.h"

namespace palpate {
namespace {

TEST(BrickArray, HoldsTheFillValueUntilWrittenAndMemoryOnlyForWrittenBricks) {
    BrickArray<float> array({70, 33, 1}, 2.5f);
    EXPECT_EQ(array.brick_count(), glm::uvec3(3, 2, 1));
    EXPECT_EQ(array.bytes(), 0u);
    EXPECT_EQ(array.value({69, 32, 0}), 2.5f);
    EXPECT_EQ(array.find({2, 1, 0}), nullptr);
    array.set({69, 32, 0}, -1.0f);
    EXPECT_EQ(array.bytes(), 4u * 32768);
    EXPECT_EQ(array.value({69, 32, 0}), -1.0f);
    EXPECT_EQ(array.value({68, 32, 0}), 2.5f); // of the same brick
    EXPECT_EQ(array.find({2, 1, 0})[offset_in_brick({5, 0, 0})], -1.0f);
    EXPECT_EQ(array.value({0, 0, 0}), 2.5f);
    array.clear({2, 1, 0});
    EXPECT_EQ(array.value({69, 32, 0}), 2.5f);
    EXPECT_EQ(array.bytes(), 0u);
}

TEST(BrickArray, BecomesAVolumeOfTheSameSamples) {
    const Grid grid = make_grid({40, 35, 33}, {1, 1, 3});
    BrickArray<float> array(grid.size, 7.0f);
    array.set({39, 34, 32}, 1.0f);
    array.set({0, 0, 0}, std::numeric_limits<float>::quiet_NaN());
    const Result<Volume> volume = take_volume(std::move(array), grid, {});
    ASSERT_TRUE(volume);
    EXPECT_EQ(volume->type(), ScalarType::f32);
    EXPECT_EQ(volume->value({39, 34, 32}), 1.0f);
    EXPECT_TRUE(std::isnan(volume->value({0, 0, 0})));
    EXPECT_EQ(volume->no_data_count(), 1u);
    EXPECT_EQ(volume->value({39, 0, 0}), 7.0f);
    EXPECT_TRUE(volume->brick({1, 0, 0}).is_constant());
    EXPECT_EQ(volume->range(), (ValueRange{1.0f, 7.0f}));
}

} // namespace
} // namespace palpate
