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
    int64_t age_ns = 0; // of samples
    DeviceSample sample;
    Wrench out;
    double stiffness_n_per_m = 1000.0;

    Wrench tick(glm::dvec3 force_n, int64_t late_ns = 0, DeviceStatus status = DeviceStatus::ok) {
        const int64_t due_ns = now_ns + kMs;
        now_ns = due_ns + late_ns;
        sample.time_ns = now_ns - age_ns;
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
    const auto turn = [&](glm::dvec3 torque_nm) {
        run.sample.time_ns = run.now_ns += kMs;
        run.chain.begin(run.now_ns, run.now_ns, DeviceStatus::ok, run.sample);
        return run.chain.finish({{}, torque_nm}, 0.0).torque_nm;
    };
    // 40 N m/s up, 100 down: 2 and 5 N/ms over 20 mm.
    EXPECT_NEAR(glm::length(turn({3, 4, 0})), 0.04, 1e-15);
    EXPECT_NEAR(glm::length(turn({3, 4, 0})), 0.08, 1e-15);
    EXPECT_NEAR(glm::length(turn({3, 4, 0})), 0.08, 1e-15);
    EXPECT_NEAR(turn({0, 0, 0.01}).z, 0.01 / (0.08 / 0.1 + 0.01 / 0.04), 1e-12); // both in a tick
    EXPECT_EQ(turn({0, 0, 0.01}), glm::dvec3(0, 0, 0.01));
}

TEST(SafetyChain, ASampleThatIsOldIsNoSampleWhateverTheStatusSays) {
    Loop run;
    run.start();
    for (int i = 0; i < 20; ++i)
        run.tick({2.5, 0, 0});
    run.age_ns = 10'000 * kMs;
    EXPECT_LE(run.tick({2.5, 0, 0}).force_n.x, 2.5);
    for (int i = 0; i < 6; ++i)
        run.tick({2.5, 0, 0});
    EXPECT_EQ(run.out, Wrench{});
    EXPECT_EQ(run.chain.faults() & kFaultLatched, uint32_t{kFaultInput});
}

TEST(SafetyChain, ASampleThatIsRepeatedWithItsOldTimeEndsAfterTheHoldAndAPeriod) {
    Loop run;
    run.start();
    int ticks = 0;
    for (; !run.chain.latched() && ticks < 100; ++ticks) {
        run.tick({2, 0, 0});
        run.age_ns += kMs;
    }
    EXPECT_EQ(ticks, 8); // ages of 0 to 6 ms are used
    EXPECT_EQ(run.out, Wrench{});
}

TEST(SafetyChain, ASampleAsOldAsADevicesPeriodIsUsed) {
    DeviceCapabilities slow = kDevice;
    slow.rate_hz = 100.0;
    Loop run;
    run.chain = SafetyChain(SafetyLimits{}, slow);
    run.start();
    for (int i = 0; i < 300; ++i) {
        run.age_ns = i % 10 * kMs;
        run.tick({2, 0, 0});
    }
    EXPECT_EQ(run.chain.faults(), 0u);
    EXPECT_NEAR(run.out.force_n.x, 2.0, 1e-9);
}

TEST(SafetyChain, AFastHandTripsThoughItsDriverLeavesTheVelocityAtZero) {
    for (const double speed : {0.6, 0.9, 1.5}) { // m/s
        Loop run;
        run.start();
        run.sample.position_m.x = -0.06;
        for (int i = 0; i < 40; ++i) { // to the other end within the 3 m/s that are believed
            run.sample.position_m.x = std::min(run.sample.position_m.x, -0.06);
            run.tick({4, 0, 0});
        }
        run.chain.arm();
        run.start();
        for (int i = 0; i < 20; ++i)
            run.tick({4, 0, 0});
        int ticks = 0;
        for (; !run.chain.latched() && ticks < 60 && run.sample.position_m.x < 0.06; ++ticks) {
            run.sample.position_m.x += speed * 1e-3;
            run.tick({4, 0, 0});
        }
        EXPECT_EQ(run.chain.faults() & kFaultLatched, speed > 0.8 ? uint32_t{kFaultVelocity} : 0u)
            << speed;
        // v (1 - exp(-t / 5 ms)) passes 0.8 m/s.
        if (speed > 0.8) {
            EXPECT_NEAR(ticks, std::ceil(-5.0 * std::log(1.0 - 0.8 / speed)), 1.0) << speed;
        }
    }
}

TEST(SafetyChain, ADeviceThatDoesNotTakeForcesHasAFault) {
    for (const DeviceStatus status : {DeviceStatus::gone, DeviceStatus::stale}) {
        Loop run;
        run.start();
        for (int i = 0; i < 20; ++i) {
            run.tick({2, 0, 0});
            run.chain.written(DeviceStatus::ok);
        }
        int ticks = 0;
        for (; !run.chain.latched() && ticks < 50; ++ticks) {
            run.tick({2, 0, 0});
            run.chain.written(status);
        }
        EXPECT_EQ(ticks, status == DeviceStatus::gone ? 1 : 6);
        EXPECT_EQ(run.tick({2, 0, 0}), Wrench{});
        EXPECT_EQ(run.chain.faults(), uint32_t{kFaultGone});
    }
    // Now and then, or without force, that is none.
    Loop run;
    run.start();
    for (int i = 0; i < 200; ++i) {
        run.tick({i < 100 ? 2.0 : 0.0, 0, 0});
        run.chain.written(i % 5 && i != 100 ? DeviceStatus::stale : DeviceStatus::ok);
    }
    EXPECT_FALSE(run.chain.latched());
}

// A motion of so many mm and Hz under so much force, for 3 s.
bool shakes(double mm, double hertz, double force_n) {
    Loop run;
    run.stiffness_n_per_m = 0.0;
    run.start();
    for (int i = 0; i < 3000 && !run.chain.latched(); ++i) {
        const double phase = 2e-3 * 3.14159265358979 * hertz * i;
        run.sample.position_m.x = 1e-3 * mm * std::sin(phase);
        run.sample.velocity_m_per_s.x = 6.28318530717959 * hertz * 1e-3 * mm * std::cos(phase);
        run.tick({force_n * std::sin(phase), 0, 0});
    }
    return run.chain.faults() & kFaultShaking;
}

TEST(SafetyChain, ALimitCycleEndsAndAHandsMotionDoesNot) {
    EXPECT_TRUE(shakes(0.3, 60.0, 3.0));
    EXPECT_TRUE(shakes(1.0, 40.0, 3.0));
    EXPECT_TRUE(shakes(0.3, 100.0, 3.0));
    EXPECT_FALSE(shakes(10.0, 3.0, 3.0)); // back and forth
    EXPECT_TRUE(shakes(5.0, 11.0, 3.0));
    EXPECT_FALSE(shakes(2.0, 7.0, 3.0));    // as fast as anybody can
    EXPECT_FALSE(shakes(0.05, 12.0, 3.0));  // tremor
    EXPECT_FALSE(shakes(0.02, 100.0, 1.0)); // vibration that is rendered
    EXPECT_FALSE(shakes(0.3, 60.0, 0.2));   // in the air
}

TEST(SafetyChain, TheStiffestCouplingIsTheMakersOrWhatDampingHoldsBehindTheDelay) {
    DeviceCapabilities device{.max_damping_n_s_per_m = 10.0};
    EXPECT_DOUBLE_EQ(most_stiffness_n_per_m({}, device, 1000.0), 20e3);
    device.delay_s = 0.002;
    EXPECT_DOUBLE_EQ(most_stiffness_n_per_m({}, device, 1000.0), 4e3);
    device.max_stiffness_n_per_m = 3e3;
    EXPECT_DOUBLE_EQ(most_stiffness_n_per_m({}, device, 1000.0), 3e3);
    EXPECT_DOUBLE_EQ(most_stiffness_n_per_m({}, {}, 1000.0), 40e3); // 20 N s/m of the limits
}

// A wall of 20 kN/m behind two ticks of delay, which the driver does not tell of.
TEST(SafetyChain, AWallThatShakesForEverEndsWithAFault) {
    DevicePreset preset = *find_device_preset("omega");
    preset.plant.delay_ticks = 2;
    SimulatedDevice device(preset, {.mass_kg = 0.0, .damping_n_s_per_m = 0.5},
                           HandPath({{.time_s = 0, .tool = {.position_mm = {-5, 0, 0}}},
                                     {.time_s = 2.5, .tool = {.position_mm = {-5, 0, 0}}},
                                     {.time_s = 3, .tool = {.position_mm = {8, 0, 0}}}}),
                           Workspace({0, 0, 0}, 1.0));
    SafetyChain chain(SafetyLimits{}, device.capabilities());
    chain.arm();
    DeviceSample sample;
    for (int64_t now = 0; now < 6'000 * kMs; now += kMs) {
        const DeviceStatus status = device.read(now, sample);
        const SafetyChain::Begun begun = chain.begin(now, now, status, sample);
        const glm::dvec3 force(-20e3 * std::max(begun.sample.position_m.x, 0.0), 0, 0);
        device.write(now, chain.finish({force, {}}, 20e3));
    }
    EXPECT_TRUE(chain.latched());
    EXPECT_EQ(device.acting_force_n(), glm::dvec3(0.0));
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
        chain.begin(i * kMs, i * kMs, DeviceStatus::ok, {.time_ns = i * kMs});
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
