#include "haptics/safety/stages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace palpate::haptics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr int64_t kMs = 1'000'000;
using Verdict = InputCheck::Verdict;

const SafetyLimits kLimits;
const DeviceCapabilities kDevice{.workspace_m = glm::dvec3(0.05)};

struct Checked {
    InputCheck check;
    int64_t now_ns = 0;
    DeviceSample sample;
    Verdict next(glm::dvec3 position_m, DeviceStatus status = DeviceStatus::ok,
                 glm::dvec3 velocity = glm::dvec3(0)) {
        now_ns += kMs;
        sample = {.time_ns = now_ns, .position_m = position_m, .velocity_m_per_s = velocity};
        return check.check(kLimits, kDevice, now_ns, status, sample);
    }
};

TEST(InputCheck, BelievesWhatAHandCanDo) {
    Checked c;
    EXPECT_EQ(c.next({0.01, 0, 0}), Verdict::good);
    EXPECT_EQ(c.next({0.0129, 0, 0}), Verdict::good); // 2.9 m/s
    EXPECT_EQ(c.next({0.0129, 0.0001, 0.0}, DeviceStatus::ok, {0, 2.9, 0}), Verdict::good);
}

TEST(InputCheck, HoldsTheLastGoodSampleForFiveMillisecondsAndThenGivesUp) {
    const auto bad = [](const char* what, auto&& send) {
        Checked c;
        EXPECT_EQ(c.next({0.01, 0.02, 0}, DeviceStatus::ok, {0.1, 0, 0}), Verdict::good);
        for (int i = 0; i < 5; ++i) {
            EXPECT_EQ(send(c), Verdict::held) << what << ' ' << i;
            EXPECT_EQ(c.sample.position_m, glm::dvec3(0.01, 0.02, 0)) << what;
            EXPECT_EQ(c.sample.velocity_m_per_s, glm::dvec3(0)) << what;
        }
        EXPECT_EQ(send(c), Verdict::lost) << what;
    };
    bad("nan", [](Checked& c) { return c.next({0.01, kNaN, 0}); });
    bad("inf", [](Checked& c) { return c.next({-kInf, 0.02, 0}); });
    bad("far", [](Checked& c) { return c.next({0.01, 0.0701, 0}); });
    bad("jump", [](Checked& c) { return c.next({0.01, -0.02, 0}); });
    bad("speed", [](Checked& c) { return c.next({0.01, 0.02, 0}, DeviceStatus::ok, {2, 2, 2}); });
    bad("nan speed", [](Checked& c) {
        return c.next({0.01, 0.02, 0}, DeviceStatus::ok, {0, kNaN, 0});
    });
    bad("stale", [](Checked& c) { return c.next({0.01, 0.02, 0}, DeviceStatus::stale); });
}

TEST(InputCheck, ARotationMustBeOne) {
    InputCheck check;
    for (const glm::dquat turn :
         {glm::dquat(0, 0, 0, 0), glm::dquat(2, 0, 0, 0), glm::dquat(kNaN, 0, 0, 1)}) {
        DeviceSample sample{.time_ns = kMs, .rotation = turn};
        EXPECT_EQ(check.check(kLimits, kDevice, kMs, DeviceStatus::ok, sample), Verdict::absent);
    }
}

TEST(InputCheck, BeforeTheFirstGoodSampleAndWithoutHomingThereIsNothingToHold) {
    Checked c;
    EXPECT_EQ(c.next({kNaN, 0, 0}), Verdict::absent);
    EXPECT_EQ(c.next({0, 0, 0}), Verdict::good);
    EXPECT_EQ(c.next({0, 0, 0}, DeviceStatus::not_homed), Verdict::absent);
    // Homing moves the origin: that is no jump.
    EXPECT_EQ(c.next({0.05, 0.05, 0}), Verdict::good);
    EXPECT_EQ(c.next({0.05, 0.05, 0}, DeviceStatus::gone), Verdict::lost);
}

TEST(InputCheck, AClockThatGoesBackIsNotBelieved) {
    Checked c;
    EXPECT_EQ(c.next({0, 0, 0}), Verdict::good);
    c.now_ns = -5 * kMs;
    EXPECT_EQ(c.next({0, 0, 0}), Verdict::lost);
}

TEST(SoftStart, NothingGoesOutUntilArmedAndQuietAndThenItFadesIn) {
    SoftStart start;
    for (int i = 0; i < 10; ++i)
        EXPECT_EQ(start.share(kLimits, true, 0.0, 1e-3), 0.0);
    start.arm();
    for (int i = 0; i < 20; ++i) // something is rendered: it waits
        EXPECT_EQ(start.share(kLimits, true, 0.3, 1e-3), 0.0);
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(start.share(kLimits, true, 0.1, 1e-3), 0.0);
    EXPECT_EQ(start.share(kLimits, true, 0.3, 1e-3), 0.0); // only three: it begins anew
    for (int i = 0; i < 4; ++i)
        EXPECT_EQ(start.share(kLimits, true, 0.1, 1e-3), 0.0);
    EXPECT_EQ(start.mode(), SoftStart::Mode::ramping);
    for (int i = 1; i <= 2000; ++i) // 2000 sums of 1 ms / 2 s: rounding far below 1e-12
        ASSERT_NEAR(start.share(kLimits, true, 5.0, 1e-3), i / 2000.0, 1e-12);
    start.share(kLimits, true, 5.0, 1e-3);
    EXPECT_EQ(start.mode(), SoftStart::Mode::running);
}

TEST(SoftStart, LettingGoFadesWithinTwentyMillisecondsAndStartsAgain) {
    SoftStart start;
    start.arm();
    for (int i = 0; i < 2100; ++i)
        start.share(kLimits, true, 0.0, 1e-3);
    double before = 1.0;
    for (int i = 1; i <= 20; ++i) {
        const double share = start.share(kLimits, false, 0.0, 1e-3);
        EXPECT_NEAR(before - share, 0.05, 1e-12);
        before = share;
    }
    EXPECT_NEAR(before, 0.0, 1e-12);
    EXPECT_EQ(start.mode(), SoftStart::Mode::waiting);
    EXPECT_LE(start.share(kLimits, true, 5.0, 1e-3), 1e-12); // pressed again in contact: waits
}

TEST(Magnitude, KeepsDirectionAndTakesNonsenseForNothing) {
    EXPECT_EQ(limit_magnitude({3, 0, 4}, 5.0), glm::dvec3(3, 0, 4));
    const glm::dvec3 cut = limit_magnitude({30, 0, -40}, 5.0);
    EXPECT_NEAR(cut.x, 3.0, 1e-14);
    EXPECT_NEAR(cut.z, -4.0, 1e-14);
    EXPECT_EQ(limit_magnitude({1, kNaN, 1}, 5.0), glm::dvec3(0));
    EXPECT_EQ(limit_magnitude({kInf, 0, 0}, 5.0), glm::dvec3(0));
    EXPECT_EQ(limit_magnitude({1, 2, 3}, 0.0), glm::dvec3(0));
    const double huge = std::numeric_limits<double>::max(); // its square overflows
    EXPECT_NEAR(glm::length(limit_magnitude({huge, -huge, huge}, 5.0)), 5.0, 1e-14);
    const double tiny = std::numeric_limits<double>::denorm_min();
    EXPECT_EQ(limit_magnitude({tiny, 0, 0}, 5.0), glm::dvec3(tiny, 0, 0));
}

TEST(Slew, RisesByTwoAndFallsByFiveNewtonsAMillisecond) {
    glm::dvec3 force(0);
    force = limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, force, {6, 0, 0}, 1e-3);
    EXPECT_NEAR(force.x, 2.0, 1e-14);
    force = limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, force, {6, 0, 0}, 1e-3);
    EXPECT_NEAR(force.x, 4.0, 1e-14);
    EXPECT_NEAR(
        limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, {6, 0, 0}, {0, 0, 0}, 1e-3).x, 1.0,
        1e-14);
    EXPECT_EQ(limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, {4, 0, 0}, {0, 0, 0}, 1e-3),
              glm::dvec3(0));
    // At 10 kHz a tick is a tenth.
    EXPECT_NEAR(
        limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, {0, 0, 0}, {0, -6, 0}, 1e-4).y, -0.2,
        1e-14);
}

// The new part of a force is what lies beyond the old one let go in part.
double new_n(glm::dvec3 before, glm::dvec3 force) {
    const double size = glm::length(before);
    const glm::dvec3 direction = size > 0.0 ? before / size : glm::dvec3(0);
    return glm::distance(force, std::clamp(glm::dot(force, direction), 0.0, size) * direction);
}

TEST(Slew, ATurnIsNoFasterThanAGrowthOfItsSize) {
    // A force of 6 N to 5 N on its other side: 6 N let go in 1.2 ms, 5 N made in 2.5 ms.
    EXPECT_NEAR(
        limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, {6, 0, 0}, {-5, 0, 0}, 1e-3).x,
        6.0 - 11.0 / 3.7, 1e-12);
    EXPECT_NEAR(
        limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, {6, 0, 0}, {-6, 0, 0}, 1e-3).x, 4.0,
        1e-12);
    std::mt19937_64 random(7);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
    for (int trial = 0; trial < 20000; ++trial) {
        const glm::dvec3 from = 6.0 * glm::dvec3(unit(), unit(), unit());
        const glm::dvec3 to = trial % 4 ? 6.0 * glm::dvec3(unit(), unit(), unit())
                                        : -0.99 * unit() * unit() * from; // straight on or back
        const glm::dvec3 next =
            limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, from, to, 1e-3);
        ASSERT_LE(new_n(from, next), 2.0 + 1e-12);
        ASSERT_LE(glm::distance(from, next),
                  glm::length(next) > glm::length(from) ? 2.0 + 1e-12 : 5.0 + 1e-12);
        ASSERT_LE(glm::length(next), std::max(glm::length(from), glm::length(to)) + 1e-12);
        // On the straight way there, and there in the time that the parts take one after the other.
        ASSERT_NEAR(glm::distance(from, next) + glm::distance(next, to), glm::distance(from, to),
                    1e-12);
        const double ms = glm::length(from) / 5.0 + new_n(from, to) / 2.0;
        glm::dvec3 force = from;
        for (int i = 0; i < 12; ++i)
            force = limit_slew(kLimits.rise_n_per_s, kLimits.fall_n_per_s, force, to, 1e-3);
        if (ms < 6.0) {
            ASSERT_EQ(force, to) << trial;
        }
    }
}

TEST(Impulse, AFullForceIsScaledDownSoThatItsIntegralStaysBelowTheLimit) {
    ImpulseLimit limit;
    double window[100] = {}, most = 0.0, sum = 0.0, last = 6.0, wavers = 0.0;
    for (int tick = 0; tick < 2000; ++tick) {
        const glm::dvec3 force = limit.limit({6, 0, 0}, 6.0, 0.1, 1e-3);
        if (tick >= 1500)
            wavers = std::max(wavers, std::abs(force.x - last));
        last = force.x;
        limit.sent(force, 1e-3);
        window[tick % 100] = force.x * 1e-3;
        sum = 0.0;
        for (const double part : window)
            sum += part;
        most = std::max(most, sum);
        if (tick < 75) { // 80 % of the window, less a bin
            ASSERT_EQ(force.x, 6.0) << tick;
        }
    }
    EXPECT_LE(most, 6.0 * 0.1);
    // Even force f with the knee at 80 %: f = F (1 - f / F) / 0.2, so f = F / 1.2.
    EXPECT_NEAR(sum / 0.1, 6.0 / 1.2, 0.02 * 6.0); // within a fiftieth of the window
    EXPECT_LE(wavers, 1e-3); // as bins end; 0.25 N where the oldest one leaves at once
}

TEST(Impulse, ShortPushesPassUnchanged) {
    ImpulseLimit limit;
    for (int tick = 0; tick < 5000; ++tick) {
        const glm::dvec3 wanted(tick % 100 < 50 ? 6.0 : 0.0, 0, 0);
        const glm::dvec3 force = limit.limit(wanted, 6.0, 0.1, 1e-3);
        ASSERT_EQ(force, wanted);
        limit.sent(force, 1e-3);
    }
}

TEST(Heat, FullForceIsTakenBackToTheContinuousOneAndTheContinuousOneLasts) {
    Heat full, continuous;
    double force = 6.0;
    int warned = -1;
    for (int tick = 0; tick < 60'000; ++tick) {
        force = std::min(6.0, full.most(kLimits, 6.0));
        full.sent(kLimits, force, 6.0, 1e-3);
        if (full.warns() && warned < 0)
            warned = tick;
        continuous.sent(kLimits, 0.6 * 6.0, 6.0, 1e-3);
    }
    // The level rises towards (1 / 0.6)^2 with 10 s: 0.8 is passed at -10 ln(1 - 0.8 * 0.36) s.
    EXPECT_NEAR(warned, -10'000 * std::log(1 - 0.8 * 0.36), 5);
    EXPECT_EQ(continuous.most(kLimits, 6.0), 6.0);
    EXPECT_LE(continuous.level(), 1.0);
    // In the end the level is the square of what is sent beside the continuous force, and what is
    // sent falls with it: both meet between 1 and 1.2.
    EXPECT_NEAR(full.level(), force * force / (3.6 * 3.6), 0.01);
    EXPECT_GT(full.level(), 1.0);
    EXPECT_LT(full.level(), 1.2);
}

} // namespace
} // namespace palpate::haptics
