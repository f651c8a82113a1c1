#include "haptics/proxy/slide_gain.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

using glm::dvec3;
using haptics::SlideGain;

TEST(SlideGain, GoesAllTheWayUntilItLearns) {
    SlideGain gain;
    EXPECT_EQ(gain.value(), 1.0);
    gain.learn({1e-5, 0, 0}, {1, 0, 0}, {-5, 0, 0}); // too short to tell
    EXPECT_EQ(gain.value(), 1.0);
}

// A place at an angle in a hollow of radius R, and a hand pushed d into the wall at angle 0: the
// plane of the place says to go -(R + d) sin(angle) along it, which turns it by that over R. All
// the way that is -d / R times the angle there was.
TEST(SlideGain, SettlesInAHollowThatPlanesOvershoot) {
    constexpr double kRadius_mm = 2.0;
    for (const double depth : {0.5, 2.0, 4.0, 15.0}) {
        const auto to_go = [&](double angle) {
            return dvec3(-(kRadius_mm + depth) * std::sin(angle), 0.0, 0.0);
        };
        SlideGain gain;
        double angle = 0.05, all_the_way = 0.05;
        for (int i = 0; i < 12; ++i) {
            const dvec3 before = to_go(angle), step = gain.value() * before;
            angle += step.x / kRadius_mm;
            gain.learn(step, before, to_go(angle));
            all_the_way += to_go(all_the_way).x / kRadius_mm;
        }
        // 0.1 um is 0.0001 N at 1 N/mm.
        EXPECT_LT(std::abs(kRadius_mm * angle), 1e-4) << depth;
        // The sine bends by angle^2 / 6 at most: 0.05 where the first step goes to 0.4.
        EXPECT_NEAR(gain.value(), std::max(0.1, kRadius_mm / (kRadius_mm + depth)), 0.05) << depth;
        if (depth >= kRadius_mm) {
            EXPECT_GT(std::abs(all_the_way), 0.04) << depth;
        }
    }
}

TEST(SlideGain, IsBetweenATenthAndAll) {
    const auto learnt = [](double after) {
        SlideGain gain;
        gain.learn({1, 0, 0}, {2, 0, 0}, {after, 0, 0});
        return gain.value();
    };
    EXPECT_EQ(learnt(1.9), 1.0); // on what bulges more would be worth going
    EXPECT_EQ(learnt(3.0), 1.0); // or the opposite
    EXPECT_EQ(learnt(0.0), 0.5);
    EXPECT_EQ(learnt(-1e6), 0.1);
}

TEST(SlideGain, FindsItsWayBackInDoubt) {
    SlideGain gain;
    gain.learn({1, 0, 0}, {1, 0, 0}, {-8, 0, 0}); // 1 / 9
    for (int i = 0; i < 50; ++i) {
        const double before = gain.value();
        gain.doubt();
        EXPECT_GT(gain.value(), before);
    }
    EXPECT_GT(gain.value(), 0.9); // 1 / (1 + 8 * 0.9^50) = 0.96
}

} // namespace
} // namespace palpate
