#include "engine/segment/simulated_seeds.h"

#include <gmock/gmock.h>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

// A ball of 20 mm and label 4 in a box, on slices of 2 mm.
Volume ball() {
    const Grid grid = make_grid({60, 60, 30}, {1, 1, 2}, {-29.5, -29.5, -29});
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return glm::length(world_point(grid, glm::dvec3(i))) <= 20.0 ? 4.0 : 1.0;
    });
}

TEST(SimulatedSeeds, LieDeepInTheObjectAndFarFromEachOther) {
    SimulatedSeedOptions options{.label = 4, .count = 5, .radius_mm = 5.0};
    options.jitter_mm = 0.0;
    const Result<SeedFile> made = simulated_seeds(ball(), options, {});
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_EQ(made->balls.size(), 5u);
    EXPECT_EQ(made->grid, ball().grid());
    for (const SeedBall& seed : made->balls) {
        EXPECT_EQ(seed.label, 4);
        // Deeper than 1.2 radii; a sample's centre lies up to half a diagonal from the surface.
        EXPECT_LE(glm::length(seed.center_mm), 20.0 - 6.0 + 1.3);
        EXPECT_GE(seed.radius_mm, 2.5);
        EXPECT_LE(seed.radius_mm, 7.5);
        for (const SeedBall& other : made->balls)
            if (&other != &seed) { // of 64 places some is that far from 4 others
                EXPECT_GE(glm::length(seed.center_mm - other.center_mm), 6.0);
            }
    }
}

TEST(SimulatedSeeds, AreTheSameForTheSameNumberAndMistakesAreAsOftenAsAsked) {
    SimulatedSeedOptions options{.label = 4, .count = 400, .radius_mm = 5.0};
    options.jitter_mm = 12.0;
    options.random = 9;
    const auto outside = [&](double mistakes) {
        options.mistakes = mistakes;
        const Result<SeedFile> made = simulated_seeds(ball(), options, {});
        int count = 0;
        for (const SeedBall& seed : made->balls)
            count += glm::length(seed.center_mm) > 21.5; // a sample beyond the surface
        return count;
    };
    EXPECT_EQ(outside(0.0), 0);
    EXPECT_GT(outside(1.0), 40); // a good part of jumps of 12 mm along each axis lands outside
    const std::string first = seeds_text(*simulated_seeds(ball(), options, {}));
    EXPECT_EQ(first, seeds_text(*simulated_seeds(ball(), options, {})));
    options.random = 10;
    EXPECT_NE(first, seeds_text(*simulated_seeds(ball(), options, {})));
}

TEST(SimulatedSeeds, WorkInThinObjectsAndRefuseWhatIsNotThere) {
    const Grid grid = make_grid({30, 1, 1}, {1, 1, 1});
    const Volume line = make_volume(grid, ScalarType::u8,
                                    [](glm::uvec3 i) { return i.x >= 10 && i.x < 14 ? 1.0 : 0.0; });
    SimulatedSeedOptions options{.label = 1, .count = 2, .radius_mm = 8.0};
    options.jitter_mm = 0.0;
    const Result<SeedFile> made = simulated_seeds(line, options, {});
    ASSERT_TRUE(made) << made.error().message;
    for (const SeedBall& seed : made->balls) {
        EXPECT_GE(seed.center_mm.x, 10.0);
        EXPECT_LE(seed.center_mm.x, 13.0);
    }
    options.label = 7;
    EXPECT_THAT(simulated_seeds(line, options, {}).error().message, testing::HasSubstr("label 7"));
}

} // namespace
} // namespace palpate
