#include "engine/render/level_choice.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace palpate {
namespace {

// The coarser the level, the faster its frames and the more they err.
constexpr std::array<double, LevelChoice::kCount> kTimes_ms{20, 18, 16, 14, 12, 10, 8, 6, 4, 2};
double error_of(size_t level) {
    return 0.001 * std::exp2(static_cast<double>(level));
}

// Draws a frame of the chosen level.
size_t draw(LevelChoice& levels, const LevelChoice::Budget& budget) {
    const size_t level = levels.number();
    const double ms = kTimes_ms[level];
    const double px = levels.level().px_per_ray;
    levels.drawn({ms, 0.9 * ms, error_of(level), 1.0 / (px * px), true}, budget);
    return level;
}

TEST(LevelChoice, BeginsAtTheBestLevelAndHoldsTheBudgetAtOnce) {
    for (const double budget_ms : {1.0, 3.0, 9.0, 30.0}) {
        SCOPED_TRACE(budget_ms);
        LevelChoice levels;
        EXPECT_EQ(draw(levels, {budget_ms}), 0u);
        // One frame at a time may be needed to learn what each of the levels takes.
        for (size_t i = 1; i < LevelChoice::kCount; ++i)
            draw(levels, {budget_ms});
        if (budget_ms < kTimes_ms.back())
            EXPECT_TRUE(levels.is_coarsest()) << "there is no faster one";
        else
            EXPECT_LE(kTimes_ms[levels.number()], budget_ms);
    }
}

// Of a budget of 11.5 ms, level 5 holds it with 10 ms and level 4 does not with 12 ms. Level 4 is
// left when its known time, the mean of what it was and 12 ms, is above 11.5 ms: after two frames
// at most, for it is tried below 0.9 x 11.5 ms. Then it fades by 0.995 a frame, and is down there
// again after ln(0.9) / ln(0.995) = 21 frames at the soonest.
TEST(LevelChoice, StaysAtTheBestLevelThatHoldsTheBudgetAndSeldomTriesTheNext) {
    LevelChoice levels;
    for (int i = 0; i < 100; ++i)
        draw(levels, {11.5});
    int tried = 0;
    constexpr int kFrames = 460;
    for (int i = 0; i < kFrames; ++i) {
        const size_t level = draw(levels, {11.5});
        ASSERT_TRUE(level == 5 || level == 4) << level;
        tried += level == 4;
    }
    EXPECT_GT(tried, 0) << "the view may have become cheaper";
    EXPECT_LE(tried, 2 * (kFrames / 23 + 1));
}

TEST(LevelChoice, ReturnsToTheBestLevelWhenThereIsTimeAgain) {
    LevelChoice levels;
    for (int i = 0; i < 20; ++i)
        draw(levels, {1.0});
    ASSERT_TRUE(levels.is_coarsest());
    for (size_t i = 0; i + 1 < LevelChoice::kCount; ++i) // one level a frame
        draw(levels, {1e9});
    EXPECT_EQ(levels.number(), 0u);
    EXPECT_EQ(levels.level().px_per_ray, 2u);
    EXPECT_EQ(levels.level().step_factor, 1.0);
}

// Time beyond the budget is taken for a picture that errs by more than the aim, and for none else.
TEST(LevelChoice, TakesTheTimeThatItsAimNeeds) {
    const auto settled = [](double aim) {
        LevelChoice levels;
        for (int i = 0; i < 30; ++i)
            draw(levels, {.frame_ms = 1.0, .aim = aim, .longest_ms = 1e9});
        return levels;
    };
    EXPECT_EQ(settled(1e-9).number(), 0u) << "no level reaches it: the best one is drawn";
    EXPECT_TRUE(settled(1e9).is_coarsest()) << "every level reaches it: the fastest one is drawn";
    // A level and the next differ by a factor of 2 here: of those that reach the aim, one within
    // that factor of it is far better than none.
    const double error = error_of(settled(0.05).number());
    EXPECT_LE(error, 0.05);
    EXPECT_GT(2.0 * error, 0.3 * 0.05) << "a coarser one would have done";
}

TEST(LevelChoice, TheSameFramesGiveTheSameLevels) {
    LevelChoice one, other;
    for (int i = 0; i < 200; ++i) {
        const LevelChoice::Budget budget{i % 50 < 25 ? 9.0 : 3.0};
        EXPECT_EQ(draw(one, budget), draw(other, budget));
    }
}

} // namespace
} // namespace palpate
