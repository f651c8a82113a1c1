#include <gmock/gmock.h>

#include "tests/unit/segment/seeded_shapes.h"

namespace palpate {
namespace {

using testing::HasSubstr;

// One seed a shape, spacing and kind; hundreds in seeded_shapes_long_test.cpp. Without noise values
// tell every sample, and with 10 % noise all but one in 10^6; Dice below 1 is the boundary's
// samples.
TEST(FastMarchingDefault, FindsShapesFromAnySeed) {
    seeded::expect_found("fast-marching", 0.0, 1, 9.0, 0.95);
    seeded::expect_found("fast-marching", 0.1, 1, 9.0, 0.9);
}

// Edges of one sample's standard deviation: many seeds lie on them. The surface is where values are
// half-way, which is the shape's, and noise of 10 % moves it by up to a third of a sample where the
// slope is 40 % a sample; a third of a sample of a ball of 12 samples is a Dice of 0.96.
TEST(FastMarchingDefault, FindsShapesFromSeedsOnBlurredEdges) {
    seeded::expect_found("fast-marching", 0.1, 1, 12.0, 0.9, 1.0);
}

// Balls whose edge is a Gaussian's or a ramp of two samples or of four: the distance that is asked
// for is that of the ball itself, to 0.1 mm, within two spacings of its surface, whatever the
// edge's profile. The widest one has not settled when its steps to the edge begin.
TEST(LevelSetEdges, DistancesAreOfTheBallWhateverItsEdge) {
    const double radius_mm = 8.0;
    const glm::dvec3 middle(0.2, -0.3, 0.1);
    for (const double ramp_mm : {0.0, 2.0, 4.0}) {
        const Grid grid = make_grid(glm::uvec3(30), glm::dvec3(1.0), glm::dvec3(-14.5));
        const auto depth = [&](glm::uvec3 i) {
            return glm::distance(world_point(grid, glm::dvec3(i)), middle) - radius_mm;
        };
        const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            const double inside = ramp_mm > 0.0
                                      ? std::clamp(0.5 - depth(i) / ramp_mm, 0.0, 1.0)
                                      : 0.5 * std::erfc(depth(i) / (std::sqrt(2.0) * 0.7));
            return 200.0 * inside;
        });
        const std::vector<SeedBall> balls{{1, {1.0, -1.0, 0.5}, 3.0}};
        const Result<Segmented> made =
            segment(*find_segment_method("level-set-edges"),
                    {volume, *seed_map(volume, balls), balls, 0}, {}, {});
        ASSERT_TRUE(made) << made.error().message;
        ASSERT_TRUE(made->distance);
        double squares = 0.0, count = 0.0;
        for (uint32_t z = 0; z < 30; ++z)
            for (uint32_t y = 0; y < 30; ++y)
                for (uint32_t x = 0; x < 30; ++x)
                    if (const double expected = depth({x, y, z}); std::abs(expected) < 1.9) {
                        const double off = made->distance->value({x, y, z}) - expected;
                        squares += off * off, ++count;
                    }
        EXPECT_GT(count, 1000.0);
        EXPECT_LE(std::sqrt(squares / count), 0.1) << "a ramp of " << ramp_mm << " mm";
    }
}

// Seeds in one plane, in values with noise: each method finds the ball, or says what it asks for.
TEST(PlaneSeeds, EachMethodGrowsOrSaysWhatItNeeds) {
    const seeded::Case one =
        seeded::make_case(seeded::Shape::ball, 9.0, {1.0, 1.0, 1.0}, 0.025, -1.0, 7);
    for (const SegmentMethod& method : segment_methods()) {
        if (!method.takes_seeds)
            continue;
        const Result<Segmented> made = segment(method, {one.volume, one.seeds, {}, 0}, {}, {});
        const std::string_view name(method.name);
        if (name == "watershed" ||
            name == "grow-from-seeds") { // takes the whole volume, and says so
            ASSERT_TRUE(made) << name;
            ASSERT_EQ(made->notes.size(), 1u);
            EXPECT_THAT(made->notes[0], HasSubstr("add seeds outside"));
            continue;
        }
        if (name == "random-walker" || name == "level-set-regions") {
            ASSERT_FALSE(made) << name;
            EXPECT_THAT(made.error().message, HasSubstr("expected seeds")) << name;
            continue;
        }
        if (name == "simplex-mesh") {
            ASSERT_FALSE(made) << name;
            EXPECT_THAT(made.error().message, HasSubstr("expected a body")) << name;
            continue;
        }
        ASSERT_TRUE(made) << name << ": " << made.error().message;
        EXPECT_GE(seeded::dice(made->labels, one.truth), 0.95) << name;
    }
}

} // namespace
} // namespace palpate
