// When a window's loop takes input and when it draws, in fixed time.

#include "apps/view/window/pacing.h"

#include <gtest/gtest.h>

namespace palpate::view {
namespace {

TEST(Pacing, InputIsTakenBeforeTheNextDrawingIsDue) {
    Pacing pacing;
    EXPECT_TRUE(pacing.begin(10.0, true)); // the first turn
    const double due_s = pacing.draw_s();
    EXPECT_NEAR(due_s, 10.0 + kFrame_s, 1e-9);
    EXPECT_LT(pacing.turn_s(), 10.0 + 0.3 * kFrame_s);
    EXPECT_FALSE(pacing.begin(pacing.turn_s(), true)); // input
    EXPECT_EQ(pacing.draw_s(), due_s) << "which puts the drawing off by nothing";
    EXPECT_TRUE(pacing.begin(due_s, true));
}

TEST(Pacing, DrawsSixtyTimesASecondWhateverInputComes) {
    Pacing pacing;
    int drawn = 0, turns = 0;
    for (double now_s = 5.0; now_s < 6.0; ++turns) {
        drawn += pacing.begin(now_s, true);
        now_s = std::max(now_s + 0.001, pacing.turn_s()); // input each millisecond
    }
    EXPECT_NEAR(drawn, 60, 1);
    EXPECT_LE(turns, 4 * 60 + 1); // a quarter of a frame apart
}

// Turns that come late do not add up, and after a pause no drawing is made up for.
TEST(Pacing, KeepsItsRateAndForgetsAPause) {
    Pacing pacing;
    double now_s = 1.0;
    int drawn = 0;
    for (; now_s < 2.0; now_s = pacing.draw_s() + 0.002)
        drawn += pacing.begin(now_s, true);
    EXPECT_NEAR(drawn, 60, 1);
    now_s = 100.0;
    EXPECT_TRUE(pacing.begin(now_s, true));
    EXPECT_GE(pacing.draw_s(), now_s);
    EXPECT_LE(pacing.draw_s(), now_s + kFrame_s + 1e-9);
}

TEST(Pacing, ADeviceThatIsBehindIsAskedAgainSoonAndNotWaitedFor) {
    Pacing pacing;
    EXPECT_TRUE(pacing.begin(1.0, true));
    const double due_s = pacing.draw_s();
    EXPECT_FALSE(pacing.begin(due_s, false));
    EXPECT_GT(pacing.draw_s(), due_s);
    EXPECT_LT(pacing.draw_s(), due_s + 0.3 * kFrame_s);
    EXPECT_TRUE(pacing.begin(pacing.draw_s(), true));
}

} // namespace
} // namespace palpate::view
