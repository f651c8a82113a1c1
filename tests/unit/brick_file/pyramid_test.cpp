#include "engine/volume/pyramid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/brick_file/coarser.h"

namespace palpate {
namespace {

double hashed_level(glm::uvec3 i) {
    return static_cast<double>((i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u) % 4001) -
           1000.0;
}

TEST(Pyramid, ASampleIsTheMeanOfThoseItStandsFor) {
    const Grid grid = make_grid({70, 33, 65}, {0.5, 0.5, 3.0}, {-10.0, 20.0, 5.0});
    const Volume fine = make_volume(grid, ScalarType::i16, hashed_level);
    const Volume coarse = coarser_volume(fine, Reduction::mean);
    ASSERT_EQ(coarse.size(), glm::uvec3(35, 17, 33));
    for (uint32_t z = 0; z < 33; ++z)
        for (uint32_t y = 0; y < 17; ++y)
            for (uint32_t x = 0; x < 35; ++x) {
                double sum = 0, count = 0;
                for (uint32_t corner = 0; corner < 8; ++corner) {
                    const glm::uvec3 at = 2u * glm::uvec3(x, y, z) +
                                          glm::uvec3(corner & 1, corner >> 1 & 1, corner >> 2);
                    if (at.x < 70 && at.y < 33 && at.z < 65) {
                        sum += hashed_level(at);
                        ++count;
                    }
                }
                ASSERT_EQ(coarse.value({x, y, z}), std::nearbyint(sum / count));
            }
}

// A linear field stays linear in world space, so the grid of the coarser level is the right one.
TEST(Pyramid, ALinearFieldLiesWhereItLay) {
    glm::dmat4 oblique(1);
    oblique[0] = glm::dvec4(0.4, 0.3, 0.0, 0.0);
    oblique[1] = glm::dvec4(-0.3, 0.4, 0.1, 0.0);
    oblique[2] = glm::dvec4(0.0, -0.2, 2.0, 0.0);
    oblique[3] = glm::dvec4(11.0, -7.0, 3.0, 1.0);
    const Grid grid{{64, 40, 2}, oblique};
    const Volume fine = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        return 2.0 * p.x - p.y + 0.5 * p.z;
    });
    const Volume coarse = coarser_volume(fine, Reduction::mean);
    EXPECT_EQ(coarse.size(), glm::uvec3(32, 20, 1));
    for (const glm::uvec3 i : {glm::uvec3(0), glm::uvec3(5, 19, 0), glm::uvec3(31, 7, 0)}) {
        const glm::dvec3 p = world_point(coarse.grid(), glm::dvec3(i));
        // Eight floats of magnitude < 128 are summed in double and rounded once: 2^-18 each.
        EXPECT_NEAR(coarse.value(i), 2.0 * p.x - p.y + 0.5 * p.z, 2 * 128.0 / (1 << 24));
    }
}

TEST(Pyramid, MissingDataCountsForNothing) {
    const Volume fine =
        make_volume(make_grid({4, 2, 2}, {1, 1, 1}), ScalarType::f32, [](glm::uvec3 i) {
            return i.x < 2 || i.x == 3 ? NAN : 7.0 + i.y; // samples 2 hold data, 0, 1 and 3 do not
        });
    const Volume coarse = coarser_volume(fine, Reduction::mean);
    EXPECT_TRUE(std::isnan(coarse.value({0, 0, 0})));
    EXPECT_EQ(coarse.value({1, 0, 0}), 7.5f);
}

TEST(Pyramid, LabelsAreNeverMixed) {
    const Volume fine = make_volume(make_grid({8, 8, 8}, {1, 1, 1}), ScalarType::u8,
                                    [](glm::uvec3 i) { return i.x % 2 ? 200.0 : 3.0; });
    EXPECT_EQ(coarser_volume(fine, Reduction::first).range(), (ValueRange{3.0f, 3.0f}));
}

TEST(Pyramid, EndsWithOneBrick) {
    EXPECT_EQ(level_count({32, 1, 32}), 1u);
    EXPECT_EQ(level_count({33, 1, 1}), 2u);
    EXPECT_EQ(level_count({2048, 2048, 1024}), 7u);
}

} // namespace
} // namespace palpate
