#include "haptics/safety/chain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "haptics/device/simulated.h"

namespace palpate::haptics {
namespace {

constexpr int64_t kMs = 1'000'000;
const DeviceCapabilities kDevice{.workspace_m = glm::dvec3(0.05),
                                 .max_force_n = 6.0,
                                 .max_torque_nm = 0.1,
                                 .max_damping_n_s_per_m = 20.0};

// A chain fed tick by tick with a hand at rest.
struct Loop {
    SafetyChain chain{SafetyLimits{}, kDevice};
    int64_t now_ns = 0;
    DeviceSample sample;
    Wrench out;
    double stiffness_n_per_m = 1000.0;

    Wrench tick(glm::dvec3 force_n, int64_t late_ns = 0, DeviceStatus status = DeviceStatus::ok) {
        const int64_t due_ns = now_ns + kMs;
        now_ns = due_ns + late_ns;
        chain.begin(now_ns, due_ns, status, sample);
        return out = chain.finish({force_n, {}}, stiffness_n_per_m);
    }
    // Armed and fully on, with no force.
    void start() {
        chain.arm();
        for (int i = 0; i < 2100; ++i)
            tick({0, 0, 0});
        ASSERT_EQ(chain.mode(), SoftStart::Mode::running);
    }
};

TEST(SafetyChain, WithoutAYesNothingEverGoesOut) {
    Loop run;
    for (int i = 0; i < 5000; ++i)
        ASSERT_EQ(run.tick({0.1, 0, 0}), Wrench{});
}

TEST(SafetyChain, SoftStartIsOnByItself) {
    Loop run;
    run.chain.arm();
    for (int i = 0; i < 4; ++i)
        EXPECT_EQ(run.tick({0.1, 0, 0}), Wrench{});
    for (int i = 1; i <= 2000; ++i)
        ASSERT_LE(run.tick({3, 0, 0}).force_n.x, 3.0 * i / 2000 * (1 + 1e-9)) << i;
    EXPECT_NEAR(run.tick({3, 0, 0}).force_n.x, 3.0, 1e-9);
}

TEST(SafetyChain, InTheRampMotionIsDamped) {
    Loop run;
    run.chain.arm();
    for (int i = 0; i < 5; ++i)
        run.tick({0, 0, 0});
    // A hand that is on its way when force begins: 3 N s/m come within a tenth of the 2 s.
    constexpr double kSpeed = 0.1;
    run.sample.velocity_m_per_s = {kSpeed, 0, 0};
    double before = run.out.force_n.x, most = 0.0;
    for (int i = 0; i < 2100; ++i) {
        const double now = run.tick({0, 0, 0}).force_n.x;
        // A tick of the ramp has passed before the first.
        ASSERT_LE(std::abs(now - before), (i == 0 ? 2 : 1) * 3.0 * kSpeed / 200 * (1 + 1e-9)) << i;
        ASSERT_DOUBLE_EQ(-now, run.chain.damping_n());
        before = now;
        most = std::max(most, -now);
    }
    EXPECT_NEAR(most, 0.9 * 3.0 * kSpeed, 1e-3);
    EXPECT_EQ(run.out.force_n.x, 0.0);
}

TEST(SafetyChain, MagnitudeIsFourFifthsOfTheDeviceAndRisesByTwoNewtonsAMillisecond) {
    Loop run;
    run.start();
    EXPECT_DOUBLE_EQ(run.chain.most_force_n(), 0.8 * 6.0);
    double before = 0.0;
    for (int i = 0; i < 10; ++i) {
        const glm::dvec3 force = run.tick({300, -400, 0}).force_n;
        const double size = glm::length(force);
        EXPECT_LE(size, 4.8 * (1 + 1e-12));
        EXPECT_LE(size - before, 2.0 * (1 + 1e-12));
        EXPECT_NEAR(force.x / size, 0.6, 1e-12);
        before = size;
    }
    EXPECT_NEAR(before, 4.8, 1e-12);
}

TEST(SafetyChain, TorqueIsLimitedToo) {
    Loop run;
    run.start();
    run.now_ns += kMs;
    run.chain.begin(run.now_ns, run.now_ns, DeviceStatus::ok, run.sample);
    EXPECT_NEAR(glm::length(run.chain.finish({{}, {3, 4, 0}}, 0.0).torque_nm), 0.08, 1e-15);
}

TEST(SafetyChain, AForceThatIsNotANumberIsZeroAtOnceAndLatches) {
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}) {
        Loop run;
        run.start();
        for (int i = 0; i < 20; ++i)
            run.tick({2, 0, 0});
        EXPECT_EQ(run.tick({0, bad, 0}), Wrench{});
        EXPECT_EQ(run.chain.faults(), uint32_t{kFaultNotFinite});
        for (int i = 0; i < 3000; ++i)
            ASSERT_EQ(run.tick({0, 0, 0}), Wrench{}); // it does not come back by itself
        run.start();
        for (int i = 0; i < 20; ++i)
            run.tick({2, 0, 0});
        EXPECT_NEAR(run.out.force_n.x, 2.0, 1e-9);
    }
}

TEST(SafetyChain, AFastHandUnderMuchForceTripsAndForceIsGoneInTwentyMilliseconds) {
    Loop run;
    run.start();
    for (int i = 0; i < 20; ++i)
        run.tick({4, 0, 0});
    run.sample.velocity_m_per_s = {0.9, 0, 0};
    run.tick({4, 0, 0});
    EXPECT_EQ(run.chain.faults(), uint32_t{kFaultVelocity});
    double before = 4.0;
    int ticks = 1;
    for (; glm::length(run.out.force_n) > 0 && ticks < 100; ++ticks) {
        EXPECT_LE(glm::length(run.out.force_n), before);
        before = glm::length(run.out.force_n);
        run.tick({4, 0, 0});
    }
    EXPECT_LE(ticks, 20);
    for (int i = 0; i < 3000; ++i)
        ASSERT_EQ(run.tick({1, 0, 0}), Wrench{});
}

TEST(SafetyChain, AFastHandUnderLittleForceGoesOn) {
    Loop run;
    run.start();
    run.stiffness_n_per_m = 0.0; // no spring that would have to be pressed first
    run.sample.velocity_m_per_s = {0.9, 0, 0};
    for (int i = 0; i < 50; ++i)
        run.tick({1, 0, 0});
    EXPECT_FALSE(run.chain.latched());
    EXPECT_NEAR(run.out.force_n.x, 1.0, 1e-9);
}

TEST(SafetyChain, LateTicksFadeForceAndVeryLateOnesStartAnew) {
    Loop run;
    run.start();
    for (int i = 0; i < 20; ++i)
        run.tick({3, 0, 0});
    run.tick({3, 0, 0}, 4 * kMs);
    EXPECT_LT(run.out.force_n.x, 3.0);
    EXPECT_EQ(run.chain.faults(), uint32_t{kFaultLate});
    for (int i = 0; i < 200; ++i)
        run.tick({3, 0, 0});
    EXPECT_NEAR(run.out.force_n.x, 3.0, 1e-9);
    EXPECT_EQ(run.tick({3, 0, 0}, 11 * kMs), Wrench{});
    EXPECT_EQ(run.chain.mode(), SoftStart::Mode::waiting);
    EXPECT_FALSE(run.chain.latched());
}

// A thread that hangs in a tick skips what it missed, and is on schedule again.
TEST(SafetyChain, ATickOnScheduleIsLateWhereTheOneBeforeWasLongAgo) {
    Loop run;
    run.start();
    for (int i = 0; i < 20; ++i)
        run.tick({3, 0, 0});
    run.now_ns += 4 * kMs;
    run.tick({3, 0, 0});
    EXPECT_LT(run.out.force_n.x, 3.0);
    EXPECT_EQ(run.chain.faults(), uint32_t{kFaultLate});
    run.now_ns += 11 * kMs;
    EXPECT_EQ(run.tick({3, 0, 0}), Wrench{});
    EXPECT_EQ(run.chain.faults(), uint32_t{kFaultTooLate});
    EXPECT_EQ(run.chain.mode(), SoftStart::Mode::waiting);
}

TEST(SafetyChain, AfterAWatchdogTookForceAwayItStartsAnew) {
    Loop run;
    run.start();
    for (int i = 0; i < 20; ++i)
        run.tick({3, 0, 0});
    run.chain.halted();
    EXPECT_EQ(run.tick({3, 0, 0}), Wrench{});
    EXPECT_EQ(run.chain.faults(), uint32_t{kFaultTooLate});
    for (int i = 0; i < 100; ++i) // in contact: it waits until the hand has let go
        ASSERT_EQ(run.tick({3, 0, 0}), Wrench{});
    run.start();
    for (int i = 0; i < 20; ++i)
        run.tick({3, 0, 0});
    EXPECT_NEAR(run.out.force_n.x, 3.0, 1e-9);
}

TEST(SafetyChain, TheDeadMansButtonIsAsked) {
    SafetyLimits limits;
    limits.needs_dead_man = true;
    limits.dead_man_button = 2;
    Loop run;
    run.chain = SafetyChain(limits, kDevice);
    run.chain.arm();
    for (int i = 0; i < 3000; ++i)
        ASSERT_EQ(run.tick({0.1, 0, 0}), Wrench{});
    run.sample.buttons = 4;
    for (int i = 0; i < 2100; ++i)
        run.tick({0.1, 0, 0});
    for (int i = 0; i < 20; ++i)
        run.tick({3, 0, 0});
    EXPECT_NEAR(run.out.force_n.x, 3.0, 1e-9);
    run.sample.buttons = 0;
    for (int i = 0; i < 20; ++i)
        run.tick({3, 0, 0});
    EXPECT_LE(run.out.force_n.x, 1e-9);
}

TEST(SafetyChain, HistoryIsTheSecondBeforeTheFault) {
    Loop run;
    run.start();
    for (int i = 0; i < 1500; ++i)
        run.tick({1 + 0.001 * i, 0, 0});
    const int64_t fault_ns = run.now_ns + kMs;
    run.tick({std::numeric_limits<double>::quiet_NaN(), 0, 0});
    for (int i = 0; i < 500; ++i)
        run.tick({0, 0, 0});
    const std::vector<SafetyRecord> history = run.chain.history();
    ASSERT_EQ(history.size(), 1000u);
    EXPECT_EQ(history.back().now_ns, fault_ns);
    EXPECT_EQ(history.back().faults, uint32_t{kFaultNotFinite});
    EXPECT_EQ(history.front().now_ns, fault_ns - 999 * kMs);
    for (size_t i = 0; i + 1 < history.size(); ++i)
        ASSERT_EQ(history[i].faults, 0u);
    EXPECT_EQ(history[998].wanted.force_n.x, 1 + 0.001 * 1499);
}

TEST(SafetyChain, ADeviceWithoutForceGetsNone) {
    SafetyChain chain(SafetyLimits{}, {.name = "mouse"});
    chain.arm();
    for (int i = 1; i < 3000; ++i) {
        chain.begin(i * kMs, i * kMs, DeviceStatus::ok, {});
        const Wrench out = chain.finish({{i < 100 ? 0.0 : 3.0, 0, 0}, {}}, 1000.0);
        ASSERT_EQ(out, Wrench{});
    }
}

// The chain in a loop with a simulated device and a hand: a wall too stiff to be stable alone.
TEST(SafetyChain, KeepsAShakingWallPassive) {
    DevicePreset preset = *find_device_preset("omega");
    preset.plant.coulomb_n = 0.0;
    SimulatedDevice device(preset, {.mass_kg = 0.0, .damping_n_s_per_m = 0.5},
                           HandPath({{.time_s = 0, .tool = {.position_mm = {-5, 0, 0}}},
                                     {.time_s = 2.5, .tool = {.position_mm = {-5, 0, 0}}},
                                     {.time_s = 3, .tool = {.position_mm = {8, 0, 0}}},
                                     {.time_s = 4, .tool = {.position_mm = {8, 0, 0}}},
                                     {.time_s = 4.5, .tool = {.position_mm = {-5, 0, 0}}}}),
                           Workspace({0, 0, 0}, 1.0));
    SafetyChain chain(SafetyLimits{}, device.capabilities());
    chain.arm();
    DeviceSample sample;
    for (int64_t now = 0; now < 5'000 * kMs; now += kMs) {
        const DeviceStatus status = device.read(now, sample);
        const SafetyChain::Begun begun = chain.begin(now, now, status, sample);
        ASSERT_TRUE(begun.usable);
        const glm::dvec3 force(-6000.0 * std::max(begun.sample.position_m.x, 0.0), 0, 0);
        device.write(now, chain.finish({force, {}}, 6000.0));
    }
    EXPECT_FALSE(chain.latched()) << fault_text(chain.faults());
    EXPECT_LE(device.motor_work_j(), 0.0);
}

} // namespace
} // namespace palpate::haptics
