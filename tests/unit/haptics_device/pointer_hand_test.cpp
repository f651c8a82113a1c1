#include "haptics/device/pointer_hand.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::haptics {
namespace {

constexpr int64_t kTick_ns = 1'000'000;
const Workspace kMetres({10, 20, 30}, 2.0, {0.8, 0.0, 0.6, 0.0});

struct Held {
    std::shared_ptr<PointerHand> pointer =
        std::make_shared<PointerHand>(PointerTarget{{{10, 20, 30}, {1, 0, 0, 0}}, 0}, kMetres);
    SimulatedDevice device{pointer_preset(), pointer_hand_model(), pointer};
    Workspace workspace = kMetres;
    int64_t now_ns = 0;
    DeviceSample sample;

    ToolPose tick(const Wrench& wrench = {}) {
        EXPECT_EQ(device.read(now_ns += kTick_ns, sample), DeviceStatus::ok);
        device.write(now_ns, wrench);
        return workspace.tool(sample);
    }
};

TEST(PointerHand, FollowsAPointerThatJumpsWithoutSwingingAndNeverFast) {
    Held held;
    EXPECT_EQ(held.tick().position_mm, glm::dvec3(10, 20, 30));
    const glm::dvec3 target(110, 20, 30);
    held.pointer->point({{target, {1, 0, 0, 0}}});
    double farthest = 0.0;
    for (int i = 0; i < 1000; ++i) {
        const ToolPose tool = held.tick();
        farthest = std::max(farthest, tool.position_mm.x);
        // The speed of a critically damped hand overshoots a step of the speed that it wants by
        // exp(-2) at most; the simulation, in steps of 20 us at 63 / s, errs by 0.13 % of it.
        ASSERT_LE(glm::length(held.sample.velocity_m_per_s),
                  1.0013 * (1.0 + std::exp(-2.0)) * PointerHand::kMost_m_per_s);
    }
    // 1 s is 30 time constants of the lag.
    EXPECT_NEAR(glm::distance(held.tick().position_mm, target), 0.0, 1e-6);
    // The lag's pole (1/32 ms) cancels the hand's zero (k / b = 1/31.6 ms) but for 1 %, whose
    // residue is below 1 % of the way that is left when the hand leaves its largest speed: 0.5 m/s
    // times the lag, 16 mm of the device, 32 mm here.
    EXPECT_LE(farthest, target.x + 0.01 * 32.0);
}

TEST(PointerHand, AForceDrawsTheHandBackByTheSpringsLength) {
    Held held;
    for (int i = 0; i < 1000; ++i)
        held.tick({{0.8, 0.0, -0.6}, {}});
    const double way_m = 1.0 / pointer_hand_model().stiffness_n_per_m;
    EXPECT_NEAR(held.sample.position_m.x, 0.8 * way_m, 1e-8);
    EXPECT_NEAR(held.sample.position_m.z, -0.6 * way_m, 1e-8);
}

TEST(PointerHand, TurnsAsItIsToldAndLeavesOutWhatIsNoPlace) {
    Held held;
    const glm::dquat turn(0.6, 0.0, 0.0, 0.8);
    held.pointer->point({{{10, 20, 30}, turn}, 1});
    held.pointer->point({{{NAN, 0, 0}, {1, 0, 0, 0}}, 0});
    held.pointer->point({{{0, 0, 0}, {2, 0, 0, 0}}, 0});
    const ToolPose tool = held.tick();
    EXPECT_NEAR(std::abs(glm::dot(tool.rotation, turn)), 1.0, 1e-12);
    EXPECT_EQ(held.sample.buttons, 1u);
    EXPECT_NEAR(glm::distance(tool.position_mm, glm::dvec3(10, 20, 30)), 0.0, 1e-9);
}

// A tool does not work on its way to where it was asked to.
TEST(PointerHand, PressesWhereItWasToldToAndNotOnItsWay) {
    Held held;
    const glm::dvec3 target(110, 20, 30), beyond(110, 80, 30);
    held.pointer->point({{target, {1, 0, 0, 0}}, 2});
    int pressed_after = 0;
    for (; pressed_after < 1000 && held.sample.buttons == 0; ++pressed_after) {
        const ToolPose tool = held.tick();
        if (pressed_after == 20) // it goes by that place though the pointer has gone on
            held.pointer->point({{beyond, {1, 0, 0, 0}}, 2});
        if (held.sample.buttons != 0) {
            EXPECT_EQ(held.sample.buttons, 2u);
            // The intention is within 0.5 mm of the device, 1 mm here; the hand that follows it
            // lags by the time of its lag, 0.032 s, at a speed of 1 mm / 0.032 s.
            EXPECT_LT(glm::distance(tool.position_mm, target), 2.0);
        }
    }
    // 50 mm of the device at 0.5 m/s, the last 16 with the lag: 68 ms and 32 ms ln(16 / 0.5).
    EXPECT_NEAR(pressed_after, 68 + 111, 5);
    for (int i = 0; i < 1000; ++i)
        held.tick();
    EXPECT_NEAR(glm::distance(held.tick().position_mm, beyond), 0.0, 1e-6);
    // A hand that is there already presses at once, and what is pressed stays so on the way.
    held.pointer->point({{beyond, {1, 0, 0, 0}}, 3});
    held.tick();
    EXPECT_EQ(held.sample.buttons, 3u);
    held.pointer->point({{target, {1, 0, 0, 0}}, 1});
    held.tick();
    EXPECT_EQ(held.sample.buttons, 1u);
    // Released before it is there: it never presses.
    held.pointer->point({{{10, 20, 30}, {1, 0, 0, 0}}, 0});
    held.tick();
    held.pointer->point({{{10, 20, 30}, {1, 0, 0, 0}}, 1});
    for (int i = 0; i < 20; ++i) {
        held.tick();
        EXPECT_EQ(held.sample.buttons, 0u);
    }
    held.pointer->point({{{10, 20, 30}, {1, 0, 0, 0}}, 0});
    for (int i = 0; i < 1000; ++i) {
        held.tick();
        EXPECT_EQ(held.sample.buttons, 0u);
    }
}

// From the bottom of a box 200 mm deep to the rim of its opening, seen from above: a straight way
// would go through the wall.
TEST(PointerHand, LeavesADepthTowardsTheEyeAndNotThroughTheWall) {
    Held held;
    const glm::dvec3 bottom(10, 20, 30), eye(10, 20, 1030), rim(40, 20, 230);
    held.pointer->point({{bottom, {1, 0, 0, 0}}, 0, eye, 6.0});
    held.tick();
    held.pointer->point({{rim, {1, 0, 0, 0}}, 0, eye, 6.0});
    double highest = 0.0;
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 at = held.tick().position_mm;
        highest = std::max(highest, at.z);
        // On the eye's ray until it is above the rim, but for the 0.5 mm of the device at which
        // the hand turns, and as much that it rounds the turn off by.
        if (at.z < rim.z + 6.0 - 2.0) {
            ASSERT_TRUE(at.x < 12.0 || at.x > rim.x - 2.0) << at.x << ' ' << at.z;
        }
    }
    EXPECT_NEAR(highest, rim.z + 6.0, 1.0);
    EXPECT_NEAR(glm::distance(held.tick().position_mm, rim), 0.0, 1e-6);
    // Down again by the straight way, and so where nothing is said of an eye.
    held.pointer->point({{bottom, {1, 0, 0, 0}}, 0, eye, 6.0});
    for (int i = 0; i < 150; ++i)
        held.tick();
    const glm::dvec3 at = held.tick().position_mm;
    EXPECT_NEAR((at.x - bottom.x) / (rim.x - bottom.x), (at.z - bottom.z) / (rim.z - bottom.z),
                1e-3);
}

} // namespace
} // namespace palpate::haptics
