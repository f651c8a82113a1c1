#include <gtest/gtest.h>

#include "tests/unit/haptics_falcon/loop_bench.h"

// The loop closed through the driver, against the same loop on a simulated device.
namespace palpate::haptics::falcon {
namespace {

struct Settled {
    double limit_cycle_mm = 0.0; // peak to peak along z in the last 0.5 s
    double depth_mm = 0.0, force_n = 0.0;
    double work_mj = 0.0;
    uint32_t faults = 0;
    int64_t period_ns = 0; // mean
};

template <class Tick>
Settled settle(const SimulatedDevice& plant, VirtualClock& clock, Tick&& tick) {
    Settled settled;
    double low = 1e9, high = -1e9;
    int ticks = 0;
    while (clock.now_ns() < 2'000 * kMs) {
        const ServoTick t = tick();
        ++ticks;
        settled.faults |= t.faults & (kFaultLatched | kFaultTooLate);
        if (clock.now_ns() < 1'500 * kMs)
            continue;
        const double z_mm = 1e3 * plant.true_position_m().z;
        low = std::min(low, z_mm);
        high = std::max(high, z_mm);
        settled.depth_mm = -z_mm;
        settled.force_n = t.sent.force_n.z;
    }
    settled.limit_cycle_mm = high - low;
    settled.work_mj = 1e3 * plant.motor_work_j();
    settled.period_ns = clock.now_ns() / ticks;
    return settled;
}

const HandModel kSoftHand{.mass_kg = 0.05, .damping_n_s_per_m = 1.5, .stiffness_n_per_m = 150.0};

Settled through_driver(double stiffness_n_per_m) {
    FalconBench bench({.path = press_path(), .hand = kSoftHand});
    FalconLoop loop(std::move(bench.open().value()), bench.clock, stiffness_n_per_m);
    return settle(bench.model.plant(), bench.clock, [&] { return loop.tick(); });
}

// The same mechanics with ideal samples, and a tick of delay as the cable has.
Settled simulated(double stiffness_n_per_m, double step_m) {
    DevicePreset preset = FakeFalcon::plant_preset();
    preset.capabilities = falcon_capabilities();
    preset.capabilities.paces = preset.capabilities.needs_homing = false;
    preset.plant.encoder_step_m = step_m;
    preset.plant.delay_ticks = 1;
    VirtualClock clock;
    auto device = std::make_unique<SimulatedDevice>(preset, kSoftHand, press_path(),
                                                    Workspace({0, 0, 0}, 1.0));
    const SimulatedDevice& plant = *device;
    FalconLoop loop(std::move(device), clock, stiffness_n_per_m);
    return settle(plant, clock, [&] { return loop.tick(); });
}

TEST(FalconLoop, AWallStandsAsOnTheSimulatedDevice) {
    // docs/reference/servo.md: 3000 N/m are the device's own limit.
    for (const double stiffness : {200.0, 500.0, 1000.0, 2000.0, 3000.0}) {
        SCOPED_TRACE(stiffness);
        const Settled driver = through_driver(stiffness);
        const Settled plain = simulated(stiffness, 48.5e-6);
        EXPECT_EQ(driver.faults, 0u) << fault_text(driver.faults);
        EXPECT_LE(driver.limit_cycle_mm, 0.05);
        EXPECT_LE(plain.limit_cycle_mm, 0.05);
        // Steps aside: both stand where spring and hand balance, to an encoder's step and what dry
        // friction of 0.4 N holds against the two springs.
        const double held_mm = 0.0485 + 1e3 * 2 * 0.4 / (stiffness + 150.0);
        EXPECT_NEAR(driver.depth_mm, plain.depth_mm, held_mm);
        EXPECT_NEAR(driver.force_n, 1e-3 * stiffness * driver.depth_mm,
                    stiffness * 0.1e-3); // two steps of the encoders
        // Late forces give the hand energy; no more through the bytes than by a tick of delay.
        EXPECT_LE(driver.work_mj, plain.work_mj + 0.05);
        EXPECT_NEAR(static_cast<double>(driver.period_ns), 1e6, 5e5);
        RecordProperty("limit_cycle_um_" + std::to_string(static_cast<int>(stiffness)),
                       static_cast<int>(1e3 * driver.limit_cycle_mm));
    }
}

} // namespace
} // namespace palpate::haptics::falcon
