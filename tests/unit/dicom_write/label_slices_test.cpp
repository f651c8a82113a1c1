// Labels as the slices of another grid, against world points.

#include <gmock/gmock.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/io/label_slices.h"
#include "tests/unit/dicom_write/series.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

Grid grid_of(const test::SeriesPlace& place) {
    Grid grid{place.size, glm::dmat4(1.0)};
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis] = glm::dvec4(place.axes[axis] * place.spacing_mm[axis], 0.0);
    grid.world_from_index[3] = glm::dvec4(place.origin_mm, 1.0);
    return grid;
}

// The grid with axes exchanged and reversed: sample i of the result is sample from(i) of the other.
Grid turned(const Grid& grid, std::array<int, 3> axes, glm::bvec3 reversed) {
    Grid out{glm::uvec3(1), glm::dmat4(0.0)};
    out.world_from_index[3] = grid.world_from_index[3];
    for (int axis = 0; axis < 3; ++axis) {
        const int from = axes[size_t(axis)];
        out.size[axis] = grid.size[from];
        out.world_from_index[axis] = grid.world_from_index[from] * (reversed[axis] ? -1.0 : 1.0);
        if (reversed[axis])
            out.world_from_index[3] += grid.world_from_index[from] * (grid.size[from] - 1.0);
    }
    return out;
}

TEST(LabelSlices, AreWhereTheLabelsAreForEveryOrderOfAxes) {
    std::mt19937 random(4);
    std::array<int, 3> axes{0, 1, 2};
    do {
        for (int reversed = 0; reversed < 8; ++reversed) {
            const Grid grid = grid_of(test::random_place(random));
            const Grid other =
                turned(grid, axes, {(reversed & 1) != 0, (reversed & 2) != 0, (reversed & 4) != 0});
            const Volume labels = test::random_labels(other, {1, 2, 300}, random);
            const auto slices = io::LabelSlices::make(labels, grid);
            ASSERT_TRUE(slices) << slices.error().message;
            EXPECT_EQ(slices->first(), 0);
            EXPECT_EQ(slices->last(), int64_t{grid.size.z} - 1);
            std::vector<uint16_t> slice;
            for (uint32_t z = 0; z < grid.size.z; ++z) {
                EXPECT_EQ(slices->read(z, slice), 0u);
                for (uint32_t y = 0; y < grid.size.y; ++y)
                    for (uint32_t x = 0; x < grid.size.x; ++x) {
                        const glm::dvec3 at = index_point(other, world_point(grid, {x, y, z}));
                        ASSERT_EQ(slice[size_t{y} * grid.size.x + x],
                                  labels.value(glm::uvec3(glm::round(at))));
                    }
            }
        }
    } while (std::next_permutation(axes.begin(), axes.end()));
}

TEST(LabelSlices, APartIsPlacedAndWhatLiesBeyondIsCounted) {
    const Grid grid = make_grid({4, 3, 5}, {1, 2, 3});
    // Two samples to the left of the grid, and two slices above its last one.
    const Grid part = make_grid({4, 3, 3}, {1, 2, 3}, {-2, 0, 12});
    const Volume ones = make_volume(part, ScalarType::u8, [](glm::uvec3) { return 1.0; });
    const auto slices = io::LabelSlices::make(ones, grid);
    ASSERT_TRUE(slices) << slices.error().message;
    EXPECT_EQ(slices->first(), 4);
    EXPECT_EQ(slices->last(), 6);
    std::vector<uint16_t> slice;
    EXPECT_EQ(slices->read(4, slice), 2u * 3u);
    EXPECT_EQ(std::count(slice.begin(), slice.end(), 1), 2 * 3);
    EXPECT_EQ(slice[0], 1);
    EXPECT_EQ(slices->read(5, slice), 4u * 3u);
    EXPECT_EQ(slices->read(3, slice), 0u);
}

TEST(LabelSlices, OtherGridsAreRefused) {
    const Grid grid = make_grid({4, 3, 5}, {1, 2, 3});
    Grid turned = grid;
    turned.world_from_index = glm::rotate(turned.world_from_index, 0.02, glm::dvec3(0, 0, 1));
    for (const Grid& other :
         {make_grid({4, 3, 5}, {1, 2, 3}, {0.5, 0, 0}),
          make_grid({4, 3, 5}, {1, 2, 3}, {0, 0.11, 0}), make_grid({4, 3, 5}, {1, 2, 1.5}),
          make_grid({4, 3, 5}, {2, 1, 3}), make_grid({4, 3, 5}, {1, 2, 3.1}), turned}) {
        const Volume labels = make_volume(other, ScalarType::u8, [](glm::uvec3) { return 1.0; });
        const auto slices = io::LabelSlices::make(labels, grid);
        ASSERT_FALSE(slices);
        EXPECT_THAT(slices.error().message, HasSubstr("another grid"));
    }
}

TEST(LabelSlices, SamplesThatAreNoLabelsAreRefused) {
    const Grid grid = make_grid({4, 3, 5}, {1, 2, 3});
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32}) {
        const bool taken = type == ScalarType::u8 || type == ScalarType::u16;
        const Volume labels = make_volume(grid, type, [](glm::uvec3) { return 1.0; });
        const auto slices = io::LabelSlices::make(labels, grid);
        ASSERT_EQ(slices.has_value(), taken) << name_of(type);
        if (!taken) {
            EXPECT_THAT(slices.error().message, HasSubstr("expected labels of the type u8 or u16"));
        }
    }
}

} // namespace
} // namespace palpate
