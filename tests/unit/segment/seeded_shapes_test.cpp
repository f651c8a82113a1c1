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

// Seeds in one plane, in values with noise: each method finds the ball, or says what it asks for.
TEST(PlaneSeeds, EachMethodGrowsOrSaysWhatItNeeds) {
    const seeded::Case one =
        seeded::make_case(seeded::Shape::ball, 9.0, {1.0, 1.0, 1.0}, 0.025, -1.0, 7);
    for (const SegmentMethod& method : segment_methods()) {
        if (!method.takes_seeds)
            continue;
        const Result<Segmented> made = segment(method, {one.volume, one.seeds, {}, 0}, {}, {});
        const std::string_view name(method.name);
        if (name == "watershed") { // takes the whole volume, and says so
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
