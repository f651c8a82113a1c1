#include "engine/segment/interpolate_slices.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

// Every fifth slice of a cone of circles; between them circles are the blend of their neighbours'.
TEST(InterpolateSlices, OfCirclesGivesTheCirclesBetween) {
    for (const int axis : {0, 1, 2}) {
        glm::uvec3 size(41);
        glm::dvec3 spacing(0.8);
        size[axis] = 26;
        spacing[axis] = 3.0;
        const Grid grid = make_grid(size, spacing);
        const auto radius = [](double k) { return 4.0 + 0.35 * k; }; // mm
        const auto off_mm = [&](glm::uvec3 i) {
            glm::dvec3 p = glm::dvec3(i) - 20.0;
            p[axis] = 0.0;
            return glm::length(p * spacing);
        };
        const Volume drawn = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
            return i[axis] % 5 == 0 && off_mm(i) < radius(i[axis]) ? 3.0 : 0.0;
        });
        const Result<Volume> made = interpolate_slices(drawn, axis, {});
        ASSERT_TRUE(made) << made.error().message;
        for (size_t n = 0; n < sample_count(grid); ++n) {
            const glm::uvec3 i = index_of(size, n);
            // Distances in a slice err by a diagonal of its samples at most, and so do blends.
            const double off = off_mm(i) - radius(i[axis]);
            if (std::abs(off) > 0.8 * std::sqrt(2.0)) {
                EXPECT_EQ(made->value(i), off < 0.0 ? 3.0f : 0.0f);
            }
            if (i[axis] % 5 == 0) {
                EXPECT_EQ(made->value(i), drawn.value(i));
            }
        }
    }
}

TEST(InterpolateSlices, KeepsWhatIsDrawnAndFillsNothingOutsideTheDrawnSlices) {
    const Volume drawn =
        make_volume(make_grid({20, 20, 12}, {1, 1, 2}), ScalarType::u16, [](glm::uvec3 i) {
            if (i.z == 2 || i.z == 8)
                return i.x < 12 ? 700.0 : 0.0;
            return i.z == 5 && i.y < 10 ? 9.0 : 0.0;
        });
    const Result<Volume> made = interpolate_slices(drawn, 2, {});
    ASSERT_TRUE(made);
    EXPECT_EQ(made->type(), ScalarType::u16);
    for (size_t n = 0; n < sample_count(drawn.grid()); ++n) {
        const glm::uvec3 i = index_of(drawn.size(), n);
        const bool between = i.z > 2 && i.z < 8 && i.x < 12;
        EXPECT_EQ(made->value(i), drawn.value(i) != 0.0f ? drawn.value(i)
                                  : between              ? 700.0f
                                                         : 0.0f);
    }
}

TEST(InterpolateSlices, GivesASampleToTheDeeperOfTwoLabels) {
    const Volume drawn =
        make_volume(make_grid({30, 30, 5}, {1, 1, 1}), ScalarType::u8, [](glm::uvec3 i) {
            const double edge = i.z == 0 ? 10 : 20;
            return i.z % 4 ? 0.0 : i.x < edge ? 1.0 : 2.0;
        });
    const Result<Volume> made = interpolate_slices(drawn, 2, {});
    for (uint32_t x = 0; x < 30; ++x) // the wall moves evenly from 10 to 20
        EXPECT_EQ(made->value({x, 15, 2}), x < 15 ? 1.0f : 2.0f) << x;
    EXPECT_FALSE(interpolate_slices(drawn, 3, {}));
    const Volume empty = make_volume(make_grid({3, 3, 3}, {1, 1, 1}), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    EXPECT_EQ(samples_of(*interpolate_slices(empty, 0, {})), samples_of(empty));
}

} // namespace
} // namespace palpate
