#include "tests/unit/haptics_safety/limit_cycles_cases.h"

namespace palpate::haptics {
namespace {

// Loops as they were found, and every 47th of all 1452.
TEST(LimitCycles, EachIsEndedWithinHalfASecondAndSaid) {
    const LoopCase found[] = {
        {"omega", 10000.0, 0.01, 3000.0, 0.3, true},   // 31 mm, 552 mJ in 3 s
        {"ideal", 10000.0, 0.01, 500.0, 0.3, true},    // 16 mm
        {"ideal", 1000.0, 0.003, 10000.0, 0.3, false}, // 13 mm at 7 Hz
        {"omega", 1000.0, 0.003, 3000.0, 0.3, false},  // 9 mm at 7 Hz
        {"falcon", 10000.0, 0.005, 3000.0, 1.0, false},
        {"touch", 1000.0, 0.01, 500.0, 0.3, false},
        {"ideal", 100.0, 0.005, 500.0, 0.3, false},
        // Bounces at 7 Hz that a tick of 10 ms makes look like a hand's.
        {"ideal", 100.0, 0.003, 3000.0, 0.3, false}, // 13 mm for as long as it was looked at
        {"ideal", 100.0, 0.003, 10000.0, 0.3, false},
    };
    for (const LoopCase& c : found)
        expect_it_is_ended(c);
    const std::vector<LoopCase> all = all_loops();
    int faults = 0;
    for (size_t i = 0; i < all.size(); i += 47)
        faults += expect_it_is_ended(all[i]).fault_s >= 0.0;
    EXPECT_GE(faults, 3);
}

TEST(LimitCycles, QuickHandsAreLetBe) {
    double most_n = 0.0;
    for (uint64_t seed = 1; seed <= 30; ++seed)
        most_n = std::max(most_n, expect_it_is_let_be(quick_hand(seed)).most_n);
    EXPECT_GT(most_n, 3.0);
    // Hands among the first 2000 that were once taken for a limit cycle: they tap, and the handle
    // rings after each blow, or they tremble while a drill vibrates at 100 Hz.
    for (const uint64_t seed : {135, 187, 443, 486, 521, 677, 831, 1024, 1491, 1895})
        expect_it_is_let_be(quick_hand(seed));
    // Hands at 100 Hz that another delay than the stated one explained by chance.
    for (const uint64_t seed : {840, 2940, 3142, 3901, 8324, 11932})
        expect_it_is_let_be(quick_hand(seed));
}

// A heavy device in a light hand on a soft wall without any delay: nothing drives it. Its swings
// fall by exp(-b t / 2 m) a second, to a seventh in 1.6 s, if nothing but hand and device damps
// them.
TEST(LimitCycles, SwingsThatNothingDrivesAreDamped) {
    DevicePreset device{.name = "heavy"};
    device.capabilities.workspace_m = glm::dvec3(0.1);
    device.capabilities.max_force_n = 10.0;
    device.capabilities.max_damping_n_s_per_m = 20.0;
    device.plant = {.mass_kg = 0.4, .damping_n_s_per_m = 0.1};
    const LoopCase c{.preset = "heavy", .stiffness_n_per_m = 450.0, .grip = 0.3, .device = &device};
    const double damping = 0.1 + 0.3 * 3.0, mass_kg = 0.4 + 0.3 * 0.1;
    ASSERT_GT(std::exp(-0.5 * damping / mass_kg * 1.5), 0.15);
    const LoopResult r = press_and_hold(c);
    EXPECT_EQ(r.faults, 0u);
    EXPECT_GE(r.begun_s, 0.0);
    EXPECT_GE(r.damped_s, 0.0); // said
    EXPECT_LE(r.last_s - r.begun_s, 0.5);
    EXPECT_LT(r.end_m, 0.25 * Swings::kLeast_m);
}

// A firm hand that takes its time on the same wall does not swing, and nothing is said.
TEST(LimitCycles, AHandThatDoesNotSwingIsNotDamped) {
    const LoopResult r =
        close_loop({.stiffness_n_per_m = 450.0, .grip = 3.0}, 2.0, 1.0,
                   [](double t) { return -5e-3 + 15e-3 * std::clamp((t - 0.3) / 0.6, 0.0, 1.0); });
    EXPECT_LT(r.begun_s, 0.0);
    EXPECT_LT(r.damped_s, 0.0);
    EXPECT_GT(r.most_n, 1.0);
}

TEST(Faults, SwingsThatAreDampedAreNamedAndNotLatched) {
    EXPECT_EQ(fault_text(kFaultDamped), "damped");
    EXPECT_EQ(kFaultDamped & kFaultLatched, 0u);
}

// Blows, 4 a second, after which the handle rings at 20 Hz and loses 40 % of its speed in a period.
TEST(Shaking, ABlowThatDiesAwayDoesNotCount) {
    for (const bool dies : {true, false}) {
        Shaking shaking;
        double shakes_s = -1.0;
        for (int tick = 0; tick < 5000 && shakes_s < 0.0; ++tick) {
            const double t = 1e-3 * tick, since_s = 1e-3 * (tick % 250);
            const double speed = 0.3 * (dies ? std::pow(0.6, 20.0 * since_s) : 1.0) *
                                 std::sin(2.0 * std::numbers::pi * 20.0 * since_s);
            if (shaking.shakes({}, {speed, 0, 0}, {2, 0, 0}, 1e-3))
                shakes_s = t;
        }
        if (dies)
            EXPECT_LT(shakes_s, 0.0);
        else { // 40 turns a second are 24 beyond a hand's
            EXPECT_GT(shakes_s, 0.0);
            EXPECT_LE(shakes_s, SafetyLimits{}.shake_turns / 24.0 + 0.05);
        }
    }
}

// The motion of a mass and a hand tells both, and the delay that the driver does not state.
TEST(SelfDriven, FindsTheDelayTheMassAndTheWork) {
    for (const double delay_s : {0.003, 0.005, 0.01}) {
        DevicePreset preset = *find_device_preset("ideal");
        const HandModel hand{.grip = 0.3};
        SimulatedDevice device(
            preset, hand,
            std::make_shared<HandAlong<double (*)(double)>>([](double) { return 5e-3; }));
        SelfDriven self_driven;
        DeviceSample sample;
        std::deque<Wrench> under_way;
        bool drives = false;
        double held_n = 0.0;
        for (int64_t now = 0; now < 1'500'000'000 && !drives; now += 1'000'000) {
            if (static_cast<double>(under_way.size()) >= delay_s * 1e3) {
                device.write(now, under_way.front());
                under_way.pop_front();
            }
            device.read(now, sample);
            drives = self_driven.drives(sample.position_m, {held_n, 0, 0}, 1e-3);
            held_n = -std::min(6.0, 1500.0 * std::max(0.0, sample.position_m.x));
            under_way.push_back({{held_n, 0, 0}, {}});
        }
        EXPECT_TRUE(drives) << delay_s;
        // Lags are 1 ms apart.
        EXPECT_NEAR(self_driven.fit().delay_s, delay_s, 1e-3);
        const double mass_kg = preset.plant.mass_kg + hand.grip * hand.mass_kg;
        EXPECT_NEAR(self_driven.fit().mass_kg, mass_kg, 0.1 * mass_kg);
        EXPECT_GT(self_driven.fit().work_j, 0.0);
    }
}

// A sine under a linear spring fits for every delay: the stated one counts, and by that it does no
// work.
TEST(SelfDriven, APureSineIsGivenTheStatedDelay) {
    SelfDriven self_driven;
    double held_n = 0.0;
    for (int tick = 0; tick < 3000; ++tick) {
        const double x = 5e-3 * std::sin(2.0 * std::numbers::pi * 6.0 * 1e-3 * tick);
        ASSERT_FALSE(self_driven.drives({x, 0, 0}, {held_n, 0, 0}, 1e-3)) << tick;
        held_n = -800.0 * x;
    }
    EXPECT_EQ(self_driven.fit().delay_s, 0.0);
    EXPECT_LT(std::abs(self_driven.fit().power_factor), 0.05);
}

} // namespace
} // namespace palpate::haptics
