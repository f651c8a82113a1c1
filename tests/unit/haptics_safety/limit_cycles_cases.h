#pragma once

#include <numbers>
#include <random>
#include <vector>

#include "tests/unit/haptics_safety/limit_cycles.h"

// The loops and the hands that limit_cycles_test.cpp takes some of, and the long test all.
namespace palpate::haptics {

// Delays, told and not, of each rate, stiffness and grip that a device of that name may have.
inline std::vector<LoopCase> all_loops() {
    std::vector<LoopCase> cases;
    for (const char* preset : {"falcon", "touch", "omega", "ideal"})
        for (const double rate_hz : {100.0, 300.0, 1000.0, 3000.0, 10000.0})
            for (const double delay_s : {0.0, 0.001, 0.002, 0.003, 0.005, 0.01})
                for (const double stiffness : {300.0, 1000.0, 3000.0, 10000.0})
                    for (const double grip : {0.3, 1.0, 3.0})
                        for (const bool is_told : {true, false}) {
                            const LoopCase c{preset, rate_hz, delay_s, stiffness, grip, is_told};
                            if (!is_stiffer_than_its_maker_says(c) && (is_told || delay_s > 0.0))
                                cases.push_back(c);
                        }
    return cases;
}

// This holds for each of them. The motors give no more than their largest force at the speed at
// which the velocity trip ends it, for as long as a cycle may last.
inline void expect_it_is_ended(const LoopCase& c, const LoopResult& r) {
    const SafetyLimits limits;
    constexpr double ends_s = 0.5;
    EXPECT_LE(r.most_n, limits.most_force_n) << c;
    if (r.fault_s >= 0.0) {
        EXPECT_TRUE(r.faults & (kFaultShaking | kFaultVelocity)) << c << fault_text(r.faults);
        // This is about a cycle that has begun; if the fault was first, none had.
        if (r.begun_s >= 0.0) {
            EXPECT_LE(r.fault_s - r.begun_s, ends_s) << c;
        }
    } else { // nothing was said: it ended by itself, and no half of a large swing goes on
        EXPECT_LE(r.last_s - r.begun_s, ends_s) << c;
        EXPECT_FALSE(r.end_m > 0.25 * Swings::kLeast_m && r.end_n > 0.5 * Swings::kLeast_n)
            << c << ": " << 1e3 * r.end_m << " mm, " << r.end_n << " N";
    }
    EXPECT_LE(r.most_made_j, limits.most_force_n * limits.trip_speed_m_per_s * ends_s) << c;
    EXPECT_LE(r.after_fault_j, 1e-9) << c;
}
inline LoopResult expect_it_is_ended(const LoopCase& c) {
    const LoopResult r = press_and_hold(c);
    expect_it_is_ended(c, r);
    return r;
}

// A quick hand that is no limit cycle: it taps, saws or presses in time, or trembles on the wall,
// with a drill that vibrates or none.
struct QuickHand {
    LoopCase loop;
    double hertz = 4.0, amplitude_m = 0.005, middle_m = 0.0, vibration_n = 0.0;
    int shape = 0; // sine, triangle, rounded square, pulses
    double at(double t) const {
        const double phase = 2.0 * std::numbers::pi * hertz * t, sine = std::sin(phase);
        const double y = shape == 0   ? sine
                         : shape == 1 ? 2.0 / std::numbers::pi * std::asin(sine)
                         : shape == 2 ? std::tanh(3.0 * sine)
                                      : 2.0 * std::exp(4.0 * (sine - 1.0)) - 1.0;
        const double share = std::clamp((t - 0.3) / 0.3, 0.0, 1.0);
        return std::lerp(-5e-3, middle_m + amplitude_m * y, share);
    }
};
inline std::ostream& operator<<(std::ostream& out, const QuickHand& h) {
    return out << h.loop << ": " << h.hertz << " Hz, " << 1e3 * h.amplitude_m << " mm about "
               << 1e3 * h.middle_m << " mm, shape " << h.shape << ", vibration " << h.vibration_n;
}

// By seed. Stiffness is at most half of what the device holds, so that the loop is passive; wanted
// speeds are at most 0.4 m/s, below the velocity trip.
inline QuickHand quick_hand(uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto between = [&](double low, double high) {
        return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
    };
    const auto one_of = [&](auto... of) {
        const std::array values{of...};
        return values[random() % values.size()];
    };
    QuickHand hand;
    LoopCase& c = hand.loop;
    c.preset = one_of("falcon", "touch", "omega", "ideal");
    c.rate_hz = one_of(100.0, 500.0, 1000.0, 4000.0, 10000.0);
    c.delay_s = one_of(0.0, 0.0, 0.001, 0.002);
    c.grip = between(1.0, 3.0);
    DeviceCapabilities device = find_device_preset(c.preset)->capabilities;
    device.delay_s = c.delay_s;
    c.stiffness_n_per_m =
        between(0.1, 0.5) * std::min(4000.0, most_stiffness_n_per_m({}, device, c.rate_hz));
    hand.shape = static_cast<int>(random() % 4);
    if (random() % 4 == 0) { // tremor (8 to 12 Hz), on the wall
        hand.hertz = between(8.0, 12.0);
        hand.amplitude_m = between(0.02e-3, 0.2e-3);
        hand.middle_m = between(1e-3, 5e-3);
        hand.shape = 0;
    } else { // by will
        hand.hertz = between(1.0, 7.5);
        const double fastest = 0.4 / (2.0 * std::numbers::pi * hand.hertz);
        hand.amplitude_m = between(1e-3, std::min(15e-3, fastest));
        hand.middle_m = between(-0.8, 1.5) * hand.amplitude_m;
    }
    hand.vibration_n = random() % 3 == 0 ? between(0.1, 1.0) : 0.0;
    return hand;
}

inline LoopResult expect_it_is_let_be(const QuickHand& hand) {
    const LoopResult r = close_loop(
        hand.loop, 3.0, 10.0, [&](double t) { return hand.at(t); }, hand.vibration_n);
    EXPECT_FALSE(r.faults & kFaultShaking) << hand << ": fault at " << r.fault_s << " s";
    return r;
}

} // namespace palpate::haptics
