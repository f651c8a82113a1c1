#include "engine/volume/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace palpate {
namespace {

// Rotated axes with a sheared third one, unequal spacing, and one or three axes reversed.
Grid oblique(double sign_x, double sign_yz) {
    Grid grid;
    grid.size = {40, 30, 20};
    grid.world_from_index[0] = glm::dvec4(sign_x * 0.5 * glm::dvec3(0.8, 0.6, 0.0), 0.0);
    grid.world_from_index[1] = glm::dvec4(sign_yz * 0.7 * glm::dvec3(-0.6, 0.8, 0.0), 0.0);
    grid.world_from_index[2] = glm::dvec4(sign_yz * 3.0 * glm::dvec3(0.28, 0.0, 0.96), 0.0);
    grid.world_from_index[3] = {-120.0, 80.0, 1000.0, 1.0};
    return grid;
}

std::vector<Grid> grids() {
    return {make_grid({5, 6, 7}, {1.0, 1.0, 1.0}), make_grid({5, 6, 7}, {0.5, 0.5, 3.0}, {9, 8, 7}),
            oblique(1.0, 1.0), oblique(-1.0, 1.0), oblique(-1.0, -1.0)};
}

std::vector<glm::dvec3> random_points(double scale) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-scale, scale);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 100; ++i)
        points.emplace_back(uniform(random), uniform(random), uniform(random));
    return points;
}

TEST(Grid, SamplesLieWhereTheHeaderSays) {
    const Grid grid = make_grid({5, 6, 7}, {0.5, 0.25, 3.0}, {10.0, -20.0, 30.0});
    EXPECT_EQ(world_point(grid, {0, 0, 0}), glm::dvec3(10.0, -20.0, 30.0));
    EXPECT_EQ(world_point(grid, {4, 5, 6}), glm::dvec3(12.0, -18.75, 48.0));
    EXPECT_EQ(center_mm(grid), glm::dvec3(11.0, -19.375, 39.0));
    EXPECT_EQ(spacing_mm(grid), glm::dvec3(0.5, 0.25, 3.0));
    EXPECT_EQ(sample_count(grid), 210u);
    EXPECT_EQ(sample_count(make_grid({65536, 65536, 4}, {1, 1, 1})), uint64_t{1} << 34);
}

TEST(Grid, SpacingIsPositiveAlongReversedAndShearedAxes) {
    for (const Grid& grid : {oblique(1.0, 1.0), oblique(-1.0, -1.0)}) {
        EXPECT_NEAR(spacing_mm(grid).x, 0.5, 1e-15);
        EXPECT_NEAR(spacing_mm(grid).y, 0.7, 1e-15);
        EXPECT_NEAR(spacing_mm(grid).z, 3.0, 1e-15);
    }
}

// Coordinates up to 1e3 mm carry 1.1e-13 mm of rounding in each of about ten operations; the
// smallest spacing, 0.5 mm, at most quadruples it in samples.
TEST(Grid, IndexAndWorldAreInverse) {
    for (const Grid& grid : grids())
        for (const glm::dvec3 p : random_points(50.0)) {
            const glm::dvec3 world = world_point(grid, p);
            EXPECT_LT(glm::length(index_point(grid, world) - p), 5e-12);
            EXPECT_LT(glm::length(glm::dvec3(index_from_world(grid) * glm::dvec4(world, 1.0)) - p),
                      5e-12);
        }
}

// A world offset of whole millimetres up to 1e7 leaves index_point() within a few roundings of
// 1e7, which are 1.9e-9 mm.
TEST(Grid, FarOriginCostsOnlyTheDigitsOfTheWorldPoint) {
    Grid near = oblique(1.0, -1.0), far = near;
    far.world_from_index[3] = {1e7, -1e7, 1e7, 1.0};
    for (const glm::dvec3 p : random_points(50.0))
        EXPECT_LT(glm::length(index_point(far, world_point(far, p)) - p), 4.0 * 1.9e-9 / 0.5);
    const glm::dmat4 a = index_from_world(near), b = index_from_world(far);
    for (int column = 0; column < 3; ++column)
        EXPECT_EQ(a[column], b[column]);
}

// The truth is a linear field in world space, differenced along the index axes.
TEST(Grid, GradientsTurnAsCovectors) {
    for (const Grid& grid : grids())
        for (const glm::dvec3 slope : random_points(10.0)) {
            glm::dvec3 per_sample;
            for (int axis = 0; axis < 3; ++axis)
                per_sample[axis] = glm::dot(slope, glm::dvec3(grid.world_from_index[axis]));
            EXPECT_LT(glm::length(world_gradient(grid, per_sample) - slope), 1e-13);
        }
}

} // namespace
} // namespace palpate
