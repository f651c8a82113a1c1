#include "bench/study/simulated_user.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/volume/builder.h"

namespace palpate::bench {
namespace {

// A ball of radius 25 mm at (40, 40, 40), and where asked one of 6 mm beside it.
Volume balls(bool with_small, double radius_mm = 25.0) {
    const Grid grid = make_grid({41, 41, 31}, {2, 2, 3});
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 index) {
        const glm::dvec3 at = world_point(grid, glm::dvec3(index));
        return glm::distance(at, {40, 40, 40}) <= radius_mm ||
                       (with_small && glm::distance(at, {10, 10, 10}) <= 6.0)
                   ? 1.0
                   : 0.0;
    });
}

TEST(SimulatedUser, PutsSeedsInDeepPlacesFarFromEachOther) {
    SimulatedUser user(7, {.aim_sd_mm = 0.0, .radius_sd = 0.0, .mistakes_kept = 0.0});
    const auto seeds = user.seeds(balls(false), 4, {});
    ASSERT_TRUE(seeds);
    ASSERT_EQ(seeds->size(), 4u);
    for (const SeedBall& seed : *seeds) {
        EXPECT_EQ(seed.radius_mm, 8.0);
        // 1.2 radii below the surface, whose samples are up to a diagonal off.
        EXPECT_LT(glm::distance(seed.center_mm, {40, 40, 40}), 25.0 - 9.6 + 4.2);
    }
    for (size_t i = 0; i < 4; ++i)
        for (size_t k = 0; k < i; ++k)
            EXPECT_GT(glm::distance((*seeds)[i].center_mm, (*seeds)[k].center_mm), 8.0);
    EXPECT_EQ(user.interaction().clicks, 4u);
    EXPECT_GT(user.interaction().path_mm, 24.0);
    EXPECT_DOUBLE_EQ(user.interaction().seconds(), 4 * 1.5 + user.interaction().path_mm / 50.0);
}

TEST(SimulatedUser, IsAFunctionOfItsSeed) {
    const Volume truth = balls(false);
    const auto first = [&](uint64_t seed) {
        return SimulatedUser(seed, {}).seeds(truth, 1, {})->front().center_mm;
    };
    EXPECT_EQ(first(1), first(1));
    EXPECT_NE(first(1), first(2));
}

// Some 300 of 600 balls aim beside a thin shell; without mistakes none stays there.
TEST(SimulatedUser, KeepsAsManyMistakesAsItsHabitsSay) {
    const Volume truth = balls(false, 9.0); // nowhere deep enough: all aim at its middle
    const auto outside = [&](double kept) {
        SimulatedUser user(3, {.aim_sd_mm = 9.0, .mistakes_kept = kept});
        int count = 0;
        const auto seeds = user.seeds(truth, 600, {});
        for (const SeedBall& seed : *seeds)
            count += glm::distance(seed.center_mm, {40, 40, 40}) > 9.0 + 4.2;
        return count;
    };
    EXPECT_EQ(outside(0.0), 0);
    EXPECT_GT(outside(0.2), 30);
}

TEST(SimulatedUser, CorrectsTheLargestErrorAtItsDeepestPoint) {
    SimulatedUser user(5, {.aim_sd_mm = 0.0});
    const auto missed = user.correct(balls(true), balls(false), {});
    ASSERT_TRUE(missed && *missed);
    EXPECT_TRUE((*missed)->add);
    EXPECT_LT(glm::distance((*missed)->ball.center_mm, {10, 10, 10}), 3.0);
    const auto surplus = user.correct(balls(false), balls(true), {});
    ASSERT_TRUE(surplus && *surplus);
    EXPECT_FALSE((*surplus)->add);
    const auto none = user.correct(balls(true), balls(true), {});
    ASSERT_TRUE(none);
    EXPECT_FALSE(*none);
    EXPECT_EQ(user.interaction().clicks, 2u);
}

TEST(SimulatedUser, RefusesNothingToSegment) {
    const Volume empty = make_volume(make_grid({8, 8, 8}, {1, 1, 1}), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    const auto seeds = SimulatedUser(1, {}).seeds(empty, 2, {});
    ASSERT_FALSE(seeds);
    EXPECT_EQ(seeds.error().message,
              "expected a label map in which some samples, and not all, have label 1");
}

} // namespace
} // namespace palpate::bench
