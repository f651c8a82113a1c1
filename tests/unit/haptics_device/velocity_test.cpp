#include "haptics/device/velocity.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::haptics {
namespace {

constexpr double kDt = 1e-3;

double quantised(double x, double step) {
    return std::floor(x / step + 0.5) * step;
}

TEST(Velocity, OfExactPositionsIsTheNewestDifference) {
    VelocityEstimator estimator;
    EXPECT_EQ(estimator.add({1, 2, 3}, kDt), glm::dvec3(0));
    EXPECT_DOUBLE_EQ(estimator.add({1.5, 2, 2.75}, kDt).x, 500.0);
    // A bend ends the window at once.
    const glm::dvec3 v = estimator.add({1.5, 2.25, 2.5}, kDt);
    EXPECT_EQ(v.x, 0.0);
    EXPECT_DOUBLE_EQ(v.y, 250.0);
    EXPECT_DOUBLE_EQ(v.z, -250.0);
}

TEST(Velocity, AtRestBetweenTwoEncoderStepsIsBelowAStepAWindow) {
    // A handle that trembles over the edge of one step reads 0 and d in turn. Plain differences say
    // d / T; a window of 16 says at most d / (15 T).
    constexpr double kStep = 50e-6;
    VelocityEstimator estimator(kStep);
    glm::dvec3 v{};
    for (int i = 0; i < 100; ++i)
        v = estimator.add({i % 2 ? kStep : 0.0, 0, 0}, kDt);
    EXPECT_LE(std::abs(v.x), kStep / (15 * kDt) * (1 + 1e-12));
}

TEST(Velocity, OfEvenMotionIsWithinAStepOverTheWindow) {
    // Both ends of the window are known to half a step each, so the slope errs by d / (15 T).
    constexpr double kStep = 50e-6;
    for (const double speed : {0.001, 0.02, 0.3}) {
        VelocityEstimator estimator(kStep);
        glm::dvec3 v{};
        for (int i = 0; i < 200; ++i) {
            v = estimator.add({quantised(speed * i * kDt, kStep), 0, 0}, kDt);
            if (i < 16)
                continue;
            ASSERT_NEAR(v.x, speed, kStep / (15 * kDt) * (1 + 1e-9)) << i;
        }
    }
}

TEST(Velocity, AStopShowsAtOnce) {
    constexpr double kStep = 50e-6;
    VelocityEstimator estimator(kStep);
    for (int i = 0; i <= 50; ++i)
        estimator.add({quantised(0.5 * i * kDt, kStep), 0, 0}, kDt);
    const double stopped = quantised(0.5 * 50 * kDt, kStep);
    // 0.5 m/s is ten steps a tick: after two ticks at rest no line through them passes the motion.
    estimator.add({stopped, 0, 0}, kDt);
    EXPECT_EQ(estimator.add({stopped, 0, 0}, kDt).x, 0.0);
}

} // namespace
} // namespace palpate::haptics
