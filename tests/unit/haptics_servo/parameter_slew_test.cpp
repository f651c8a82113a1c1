#include "haptics/servo/parameter_slew.h"

#include <gtest/gtest.h>

namespace palpate::haptics {
namespace {

TEST(ParameterSlew, TakesTheFirstAsTheyAreAndMovesToOthersInTwentyMilliseconds) {
    ParameterSlew slew;
    TouchParameters target;
    target.stiffness_n_per_m = 400.0;
    EXPECT_EQ(slew.step(target, 1e-3).stiffness_n_per_m, 400.0);
    target.stiffness_n_per_m = 800.0;
    target.iso = 300.0;
    double before = 400.0;
    for (int ms = 1; ms <= 20; ++ms) {
        const double now = slew.step(target, 1e-3).stiffness_n_per_m;
        EXPECT_NEAR(now - before, 20.0, 1e-9) << ms; // 5 % of the change
        before = now;
    }
    EXPECT_EQ(slew.step(target, 1e-3).stiffness_n_per_m, 800.0);
    EXPECT_EQ(slew.step(target, 1e-3).iso, 300.0);
}

TEST(ParameterSlew, ATargetThatMovesOnIsFollowedFromWhereItIs) {
    ParameterSlew slew;
    TouchParameters target;
    target.stiffness_n_per_m = 0.0;
    slew.step(target, 1e-3);
    target.stiffness_n_per_m = 1000.0;
    double now = 0.0;
    for (int ms = 0; ms < 10; ++ms)
        now = slew.step(target, 1e-3).stiffness_n_per_m;
    EXPECT_NEAR(now, 500.0, 1e-9);
    target.stiffness_n_per_m = 0.0;
    EXPECT_NEAR(slew.step(target, 1e-3).stiffness_n_per_m, 475.0, 1e-9);
}

// A T0 of 0 is never: from there it comes down from any force, and it goes back up the same way.
TEST(ParameterSlew, AYieldForceComesFromNeverAndGoesThereByWhatItGives) {
    ParameterSlew slew;
    TouchParameters target;
    slew.step(target, 1e-3);
    target.yield_n = 2.0;
    for (int ms = 1; ms < 20; ++ms)
        EXPECT_NEAR(slew.step(target, 1e-3).yield_n, 2.0 * 20.0 / ms, 1e-9) << ms;
    EXPECT_EQ(slew.step(target, 1e-3).yield_n, 2.0);
    target.yield_n = 0.0;
    for (int ms = 1; ms < 20; ++ms)
        EXPECT_NEAR(slew.step(target, 1e-3).yield_n, 2.0 * 20.0 / (20 - ms), 1e-6) << ms;
    EXPECT_EQ(slew.step(target, 1e-3).yield_n, 0.0);
}

} // namespace
} // namespace palpate::haptics
