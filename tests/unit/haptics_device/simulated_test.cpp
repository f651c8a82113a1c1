#include "haptics/device/simulated.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate::haptics {
namespace {

constexpr int64_t kTick_ns = 1'000'000;
const Workspace kMetres({0, 0, 0}, 1.0);

HandPath rest(glm::dvec3 at_mm = {0, 0, 0}) {
    return HandPath({{.time_s = 0, .tool = {.position_mm = at_mm}}});
}

DevicePreset plain() {
    return *find_device_preset("ideal");
}

TEST(SimulatedDevice, FreeMassUnderConstantForceMovesAsDampedMotionMust) {
    DevicePreset preset = plain();
    preset.plant = {.mass_kg = 0.25, .damping_n_s_per_m = 2.0};
    SimulatedDevice device(preset, {.grip = 0.0}, rest(), kMetres);
    device.write(0, {{1.0, 0, 0}, {}});
    DeviceSample sample;
    for (int64_t now = kTick_ns; now <= 200 * kTick_ns; now += kTick_ns)
        device.read(now, sample);
    // v = F/b (1 - e^(-t b/m)); x = F/b (t - m/b (1 - e^(-t b/m))). The scheme is of first order:
    // its error is at most (dt b / m) / 2 of the velocity it approaches, 8e-5 of 0.5 m/s.
    const double t = 0.2, decay = 1 - std::exp(-t * 2.0 / 0.25);
    const double v = 0.5 * decay, x = 0.5 * (t - 0.125 * decay);
    EXPECT_NEAR(device.true_velocity_m_per_s().x, v, 8e-5 * 0.5);
    EXPECT_NEAR(device.true_position_m().x, x, 8e-5 * 0.5 * t + 20e-6 * v);
    // Work of a constant force is force times way, whatever the steps.
    EXPECT_NEAR(device.motor_work_j(), device.true_position_m().x, 1e-14);
}

TEST(SimulatedDevice, AHandLetGoSwingsAtItsOwnFrequency) {
    DevicePreset preset = plain();
    preset.plant = {.mass_kg = 0.2, .damping_n_s_per_m = 0.0};
    // The path steps by 10 mm at the start; mass 0.3 kg on 300 N/m swings about it.
    const HandPath path({{.time_s = 0, .tool = {.position_mm = {0, 0, 0}}},
                         {.time_s = 1e-9, .tool = {.position_mm = {10, 0, 0}}}});
    SimulatedDevice device(preset,
                           {.mass_kg = 0.1, .damping_n_s_per_m = 0.0, .stiffness_n_per_m = 300.0},
                           path, kMetres);
    DeviceSample sample;
    int crossings = 0;
    double before = -0.01, first_s = 0, last_s = 0;
    for (int64_t now = 20'000; now <= 2'000'000'000; now += 20'000) {
        device.read(now, sample);
        const double x = device.true_position_m().x - 0.01;
        if (before < 0 && x >= 0) {
            last_s = static_cast<double>(now) * 1e-9;
            if (crossings++ == 0)
                first_s = last_s;
        }
        before = x;
    }
    ASSERT_GT(crossings, 5);
    const double period_s = (last_s - first_s) / (crossings - 1);
    // The symplectic scheme keeps the frequency to (w dt)^2 / 24, 2e-8; crossings are seen to 20
    // us.
    EXPECT_NEAR(period_s, 2 * M_PI / std::sqrt(300.0 / 0.3), 20e-6 / (crossings - 1) * 2);
}

TEST(SimulatedDevice, DryFrictionHoldsUpToItsForceAndTakesItOffBeyond) {
    DevicePreset preset = plain();
    preset.plant = {.mass_kg = 0.5, .damping_n_s_per_m = 0.0, .coulomb_n = 0.4};
    SimulatedDevice device(preset, {.grip = 0.0}, rest(), kMetres);
    DeviceSample sample;
    device.write(0, {{0.24, 0.31, 0}, {}}); // 0.392 N
    device.read(100 * kTick_ns, sample);
    EXPECT_EQ(device.true_position_m(), glm::dvec3(0));
    device.write(100 * kTick_ns, {{0.6, 0.8, 0}, {}}); // 1 N: 0.6 N is left along it
    device.read(200 * kTick_ns, sample);
    // Each step adds dt (F - f_c) / m exactly.
    EXPECT_NEAR(device.true_velocity_m_per_s().x, 0.1 * 0.6 * 0.6 / 0.5, 1e-12);
    EXPECT_NEAR(device.true_velocity_m_per_s().y, 0.1 * 0.6 * 0.8 / 0.5, 1e-12);
    device.write(200 * kTick_ns, {});
    device.read(600 * kTick_ns, sample); // it needs 0.15 s to stop
    EXPECT_EQ(device.true_velocity_m_per_s(), glm::dvec3(0));
}

TEST(SimulatedDevice, ForcesActAsManyWritesLaterAsThereAreTicksOfDelay) {
    for (const uint32_t delay : {0u, 1u, 2u}) {
        DevicePreset preset = plain();
        preset.plant.delay_ticks = delay;
        SimulatedDevice device(preset, {.grip = 0.0}, rest(), kMetres);
        for (int tick = 1; tick <= 5; ++tick) {
            device.write(tick * kTick_ns, {{0.1 * tick, 0, 0}, {}});
            const int acts = tick - static_cast<int>(delay);
            EXPECT_EQ(device.acting_force_n().x, acts > 0 ? 0.1 * acts : 0.0);
        }
    }
}

TEST(SimulatedDevice, ForcesBeyondItsLimitKeepTheirDirectionAndNonsenseIsNothing) {
    DevicePreset preset = plain();
    preset.capabilities.max_force_n = 5.0;
    SimulatedDevice device(preset, {}, rest(), kMetres);
    device.write(0, {{30.0, 0, -40.0}, {}});
    EXPECT_NEAR(device.acting_force_n().x, 3.0, 1e-14);
    EXPECT_NEAR(device.acting_force_n().z, -4.0, 1e-14);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {nan, std::numeric_limits<double>::infinity()}) {
        device.write(0, {{1.0, bad, 0}, {}});
        EXPECT_EQ(device.acting_force_n(), glm::dvec3(0));
    }
}

TEST(SimulatedDevice, PositionsComeInEncoderStepsAndTheHandIsStoppedAtTheWalls) {
    DevicePreset preset = *find_device_preset("falcon");
    const HandPath path({{.time_s = 0}, {.time_s = 0.5, .tool = {.position_mm = {200, 0, 0}}}});
    SimulatedDevice device(preset, {}, path, kMetres);
    DeviceSample sample;
    for (int64_t now = kTick_ns; now <= 1000 * kTick_ns; now += kTick_ns) {
        device.read(now, sample);
        const double steps = sample.position_m.x / preset.plant.encoder_step_m;
        ASSERT_NEAR(steps, std::round(steps), 1e-9);
        ASSERT_LE(std::abs(sample.position_m.x - device.true_position_m().x),
                  preset.plant.encoder_step_m / 2 * (1 + 1e-9));
        ASSERT_LE(device.true_position_m().x, preset.capabilities.workspace_m.x);
    }
    EXPECT_EQ(device.true_position_m().x, preset.capabilities.workspace_m.x);
    EXPECT_EQ(device.true_velocity_m_per_s().x, 0.0);
}

// A wall of stiffness k sampled every T, entered to depth d and left at speed v, makes k v T d:
// force lags behind motion by half a tick on both ways.
double energy_of_a_press(double k, double v, double period_s, double depth) {
    DevicePreset preset = plain();
    // So thick a damper that no force turns the hand from its velocity, by more than F / b.
    const HandModel hand{.mass_kg = 1.0, .damping_n_s_per_m = 1e15, .stiffness_n_per_m = 0.0};
    const double way_s = depth / v;
    std::vector<HandPose> poses{{.time_s = 0},
                                {.time_s = way_s, .tool = {.position_mm = {1000 * depth, 0, 0}}},
                                {.time_s = 2 * way_s, .tool = {.position_mm = {0, 0, 0}}}};
    SimulatedDevice device(preset, hand, HandPath(std::move(poses)), kMetres);
    const auto ticks = std::llround(2 * way_s / period_s);
    DeviceSample sample;
    for (int64_t i = 0; i <= ticks; ++i) {
        const int64_t now = std::llround(static_cast<double>(i) * period_s * 1e9);
        device.read(now, sample);
        device.write(now, {{-k * std::max(sample.position_m.x, 0.0), 0, 0}, {}});
    }
    return device.motor_work_j();
}

TEST(SimulatedDevice, ItsEnergyMeterFindsWhatAHeldForceMakes) {
    for (const double k : {300.0, 1000.0})
        for (const double v : {0.05, 0.2})
            for (const double period_s : {1e-3, 2e-4}) {
                const double expected = k * v * period_s * 0.005;
                EXPECT_NEAR(energy_of_a_press(k, v, period_s, 0.005), expected, 1e-3 * expected)
                    << k << ' ' << v << ' ' << period_s;
            }
}

TEST(SimulatedDevice, TheSameWrenchesGiveTheSameBits) {
    const HandPath path = find_trajectory("reach")->make({.duration_s = 0.5});
    const auto run = [&] {
        SimulatedDevice device(*find_device_preset("touch"), {}, path, Workspace({0, 0, 0}, 1.0));
        std::vector<double> all;
        DeviceSample sample;
        for (int64_t now = 0; now < 500 * kTick_ns; now += kTick_ns) {
            device.read(now, sample);
            device.write(now, {-200.0 * sample.position_m - 0.5 * sample.velocity_m_per_s, {}});
            for (int axis = 0; axis < 3; ++axis)
                all.push_back(sample.position_m[axis]),
                    all.push_back(sample.velocity_m_per_s[axis]);
        }
        return all;
    };
    EXPECT_EQ(run(), run());
}

TEST(Presets, AreThoseOfTheTableAndHoldTogether) {
    for (const DevicePreset& preset : device_presets()) {
        EXPECT_EQ(find_device_preset(preset.name), &preset);
        EXPECT_GT(preset.plant.mass_kg, 0);
        EXPECT_LT(preset.plant.coulomb_n, preset.capabilities.max_force_n);
        EXPECT_EQ(preset.plant.encoder_step_m, preset.capabilities.resolution_m);
    }
    EXPECT_EQ(find_device_preset("phantom"), nullptr);
}

} // namespace
} // namespace palpate::haptics
