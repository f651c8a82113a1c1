#include "engine/segment/resample.h"

#include <gmock/gmock.h>

#include "engine/segment/grid_change.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

Volume whole(const Result<BrickMaker>& maker) {
    return make_bricks(maker.value(), {}).value();
}

// At each place of the patient the samples are those of the input.
void expect_same_places(const Volume& made, const Volume& from, float outside) {
    for (const glm::ivec3 i : twin::indices(glm::ivec3(made.size()))) {
        const glm::dvec3 mm = world_point(made.grid(), glm::dvec3(i));
        const glm::ivec3 at(glm::round(index_point(from.grid(), mm)));
        const bool inside = glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
                            glm::all(glm::lessThan(at, glm::ivec3(from.size())));
        const float expected = inside ? from.value(glm::uvec3(at)) : outside;
        const float found = made.value(glm::uvec3(i));
        ASSERT_TRUE(found == expected || (std::isnan(found) && std::isnan(expected)))
            << i.x << "," << i.y << "," << i.z;
    }
}

TEST(GridChange, ThePatientDoesNotMove) {
    for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32}) {
        const Volume v = twin::noise(twin::turned({45, 34, 7}, {0.5, 0.8, 3}, true), type,
                                     type == ScalarType::f32 ? 5 : 0);
        const Volume cropped = whole(crop_bricks(v, {3, 1, 2}, {40, 33, 2}));
        EXPECT_EQ(cropped.size(), glm::uvec3(38, 33, 1));
        expect_same_places(cropped, v, 0);
        const Volume padded = whole(pad_bricks(v, {33, 0, 2}, {1, 5, 0}, 7));
        EXPECT_EQ(padded.size(), glm::uvec3(79, 39, 9));
        expect_same_places(padded, v, 7);
        EXPECT_TRUE(twin::same_bits(whole(crop_bricks(padded, {33, 0, 2}, {77, 33, 8})), v));
        for (const int axis : {0, 1, 2}) {
            const Volume flipped = whole(flip_bricks(v, axis));
            expect_same_places(flipped, v, 0);
            glm::uvec3 last(0);
            last[axis] = v.size()[axis] - 1;
            const float a = flipped.value(glm::uvec3(0)), b = v.value(last);
            EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b)));
            EXPECT_TRUE(twin::same_bits(whole(flip_bricks(flipped, axis)), v));
        }
    }
}

TEST(GridChange, RefusesWhatLiesBeyond) {
    const Volume v = twin::noise(make_grid({8, 8, 8}, {1, 1, 1}), ScalarType::u8);
    EXPECT_EQ(crop_bricks(v, {0, 0, 0}, {7, 8, 7}).error().message,
              "expected samples within 0 .. 7 on axis y, found 0 .. 8");
    EXPECT_EQ(crop_bricks(v, {5, 0, 0}, {4, 7, 7}).error().message,
              "expected samples within 0 .. 7 on axis x, found 5 .. 4");
    EXPECT_EQ(pad_bricks(v, {-1, 0, 0}, {0, 0, 0}, 0).error().message,
              "expected 0 .. 4096 samples on axis x, found -1 and 0");
    EXPECT_EQ(pad_bricks(v, {1, 0, 0}, {0, 0, 0}, 256).error().message,
              "value: expected one of the type u8, found 256");
}

TEST(Resample, GridOfASpacingKeepsBoxAndMiddle) {
    const Grid grid = twin::turned({10, 20, 7}, {1, 0.5, 3});
    const Grid made = grid_of_spacing(grid, {2, 1, 1}).value();
    EXPECT_EQ(made.size, glm::uvec3(5, 10, 21));
    EXPECT_LT(glm::distance(center_mm(made), center_mm(grid)), 1e-9);
    EXPECT_LT(
        glm::distance(world_point(made, {-0.5, -0.5, -0.5}), world_point(grid, {-0.5, -0.5, -0.5})),
        1e-9);
    EXPECT_EQ(grid_of_spacing(grid, {0, 1, 1}).error().message,
              "spacing: expected a length above 0 mm, found 0");
}

// Linear gives linear functions, and the cubic spline cubic ones away from the border (its
// coefficients are cut at 12 samples, and reach as far), on a grid turned against the input's.
TEST(Resample, PolynomialsAreExact) {
    const Grid grid = make_grid({60, 56, 52}, {1, 1.2, 1.5}, {-30, -33, -39});
    const auto line = [](glm::dvec3 p) { return 3 * p.x - 2 * p.y + p.z + 5; };
    const auto cube = [](glm::dvec3 p) {
        return 0.01 * p.x * p.x * p.x - 0.02 * p.x * p.y * p.z + 0.3 * p.z * p.z + p.y;
    };
    Grid target = twin::turned({36, 9, 5}, {0.4, 0.5, 0.9});
    target.world_from_index[3] = glm::dvec4(-5, -4, 0, 1);
    const auto sampled = [&](const auto& f) {
        return make_volume(grid, ScalarType::f32,
                           [&](glm::uvec3 i) { return f(world_point(grid, glm::dvec3(i))); });
    };
    const Volume straight = resample(sampled(line), {target, ResampledBy::linear, 0}, {}).value();
    const Volume curved = resample(sampled(cube), {target, ResampledBy::cubic, 0}, {}).value();
    for (const glm::ivec3 i : twin::indices({36, 9, 5})) {
        const glm::dvec3 p = world_point(target, glm::dvec3(i));
        EXPECT_NEAR(straight.value(glm::uvec3(i)), line(p),
                    1e-4); // of values below 250: 2^-24 each
        // Samples reach 12 farther: values below 500, cut off 1.4e-7 of them on each axis.
        EXPECT_NEAR(curved.value(glm::uvec3(i)), cube(p), 3 * 500 * 3e-7) << i.x;
    }
}

TEST(Resample, CubicRefusesValuesWhoseSumsAreNoFloats) {
    const Grid grid = make_grid({8, 4, 4}, {1, 1, 1});
    const Volume edge =
        make_volume(grid, ScalarType::f32, [](glm::uvec3 i) { return i.x < 4 ? -3e38 : 3e38; });
    EXPECT_FALSE(resample(edge, {grid, ResampledBy::cubic, 0.0}, {}));
    const Result<Volume> linear = resample(edge, {grid, ResampledBy::linear, 0.0}, {});
    ASSERT_TRUE(linear);
    EXPECT_EQ(linear->value({7, 2, 2}), 3e38f);
}

TEST(Resample, OntoItselfIsTheSame) {
    for (const uint32_t missing : {0u, 5u}) {
        const Volume v =
            twin::noise(twin::turned({37, 9, 34}, {0.7, 1, 2}, true), ScalarType::f32, missing);
        const auto again = [&](ResampledBy how) {
            return resample(v, {v.grid(), how, 0}, {}).value();
        };
        EXPECT_TRUE(twin::same_bits(again(ResampledBy::nearest), v));
        const Volume linear = again(ResampledBy::linear), cubic = again(ResampledBy::cubic);
        for (const glm::ivec3 i : twin::indices({37, 9, 34})) {
            const float expected = v.value(glm::uvec3(i));
            ASSERT_EQ(std::isnan(linear.value(glm::uvec3(i))), std::isnan(expected));
            ASSERT_EQ(std::isnan(cubic.value(glm::uvec3(i))), std::isnan(expected));
            if (!std::isnan(expected)) {
                ASSERT_NEAR(linear.value(glm::uvec3(i)), expected, 1e-3);
                // The spline runs through the samples; coefficients are up to 3^3 times as large.
                ASSERT_NEAR(cubic.value(glm::uvec3(i)), expected, 27 * 1500 * 1e-6);
            }
        }
    }
}

TEST(Resample, NearestKeepsTypeAndLabelsAndFarPlacesHaveNoData) {
    const Volume v = twin::noise(make_grid({20, 10, 6}, {1, 1, 2}), ScalarType::u8);
    Grid wide = make_grid({60, 30, 20}, {0.5, 0.5, 1}, {-5, -2, -3});
    const Volume labels = resample(v, {wide, ResampledBy::nearest, 9}, {}).value();
    EXPECT_EQ(labels.type(), ScalarType::u8);
    const Volume linear = resample(v, {wide, ResampledBy::linear, 0}, {}).value();
    for (const glm::ivec3 i : twin::indices({60, 30, 20})) {
        const glm::dvec3 at = index_point(v.grid(), world_point(wide, glm::dvec3(i)));
        bool inside = true;
        for (int a = 0; a < 3; ++a)
            inside = inside && at[a] >= -0.5 && at[a] <= v.size()[a] - 0.5;
        ASSERT_EQ(std::isnan(linear.value(glm::uvec3(i))), !inside);
        if (!inside) {
            ASSERT_EQ(labels.value(glm::uvec3(i)), 9.0f);
        }
    }
    // A coarse grid: a block of the result lies over much of the input.
    const Volume big = make_volume(make_grid({300, 300, 300}, {1, 1, 1}), ScalarType::u8,
                                   [](glm::uvec3 i) { return i.x * 7 % 31 + i.y % 5 + i.z % 3; });
    const Grid coarse = grid_of_spacing(big.grid(), {10, 10, 10}).value();
    const Volume few = resample(big, {coarse, ResampledBy::nearest, 0}, {}).value();
    EXPECT_EQ(few.size(), glm::uvec3(30));
    EXPECT_EQ(few.value({29, 3, 11}), big.value({294, 34, 114})); // the lower of two as near
    EXPECT_THAT(resample(v, {make_grid({4, 4, 4}, {1, 1, 1}, {500, 0, 0})}, {}).error().message,
                ::testing::HasSubstr("the grid"));
}

} // namespace
} // namespace palpate
