#pragma once

#include "tests/unit/haptics_safety/limit_cycles_cases.h"

// Devices, delays, hands and surfaces by seed that no other test knows: nothing in
// haptics/safety was made by them.
namespace palpate::haptics {

class Drawn {
 public:
    explicit Drawn(uint64_t seed) : random_(0x9e3779b97f4a7c15u * seed + 77) {}
    double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
    }
    double evenly_by_size(double low, double high) {
        return std::exp(between(std::log(low), std::log(high)));
    }
    bool one_in(uint64_t count) { return random_() % count == 0; }

 private:
    std::mt19937_64 random_;
};

inline DevicePreset other_device(Drawn& drawn) {
    DevicePreset device{.name = "drawn"};
    device.capabilities.workspace_m = glm::dvec3(0.1);
    device.capabilities.max_force_n = drawn.between(3.0, 12.0);
    device.capabilities.max_stiffness_n_per_m = drawn.evenly_by_size(500.0, 20000.0);
    device.capabilities.max_damping_n_s_per_m = drawn.between(4.0, 40.0);
    device.plant = {.mass_kg = drawn.evenly_by_size(0.04, 0.6),
                    .damping_n_s_per_m = drawn.between(0.0, 2.0),
                    .coulomb_n = drawn.one_in(3) ? 0.0 : drawn.between(0.0, 0.6),
                    .encoder_step_m = drawn.one_in(3) ? 0.0 : drawn.between(2e-6, 60e-6)};
    return device;
}

// A hand presses at any speed to any depth and rests, but for tremor. What a loop may not do is as
// in limit_cycles_cases.h.
struct OtherLoop {
    DevicePreset device;
    LoopCase loop;
    double depth_m, press_s, tremor_m;
    LoopResult run() const {
        LoopCase c = loop;
        c.device = &device;
        return close_loop(c, 2.0, 0.3 + press_s, [&](double t) {
            return std::lerp(-4e-3, depth_m, std::clamp((t - 0.3) / press_s, 0.0, 1.0)) +
                   tremor_m * std::sin(2.0 * std::numbers::pi * 9.3 * t);
        });
    }
};
inline OtherLoop other_loop(uint64_t seed) {
    Drawn drawn(seed);
    OtherLoop other{.device = other_device(drawn)};
    LoopCase& c = other.loop;
    c.preset = "drawn";
    c.rate_hz = drawn.evenly_by_size(100.0, 10000.0);
    c.delay_s = drawn.one_in(4) ? 0.0 : drawn.between(0.0, 0.012);
    c.is_told = drawn.one_in(2);
    c.grip = drawn.evenly_by_size(0.25, 3.0);
    c.stiffness_n_per_m =
        drawn.evenly_by_size(0.1, 1.0) * other.device.capabilities.max_stiffness_n_per_m;
    other.depth_m = drawn.between(2e-3, 20e-3);
    other.press_s = drawn.between(0.05, 0.3);
    other.tremor_m = drawn.one_in(2) ? 0.0 : drawn.between(0.0, 0.1e-3);
    return other;
}

// A hand that means each motion: it taps in an uneven rhythm, or slides over waves, to and fro or
// on and on, with tremor. The loop is passive: at most half of what the device holds.
struct OtherHand {
    DevicePreset device;
    LoopCase loop;
    bool slides = false, turns = false;
    double hertz, amplitude_m, middle_m, uneven, speed_m_per_s, tremor_m, vibration_n;
    WavyWall wall;
    glm::dvec3 at(double t) const {
        const double share = std::clamp((t - 0.3) / 0.3, 0.0, 1.0), turn = 2.0 * std::numbers::pi;
        const double trembles = tremor_m * std::sin(turn * 10.1 * t);
        if (slides) {
            const double swing_m = speed_m_per_s / (turn * hertz);
            const double y = turns ? swing_m * std::sin(turn * hertz * t)
                                   : std::min(speed_m_per_s * t, 0.16) - 0.08;
            return {std::lerp(-5e-3, middle_m, share) + trembles, y, 0.3 * y};
        }
        const double phase = turn * hertz * t + uneven * std::sin(turn * 0.37 * hertz * t);
        const double tap = std::pow(0.5 + 0.5 * std::sin(phase), 1.0 + 2.0 * uneven);
        return {std::lerp(-5e-3, middle_m + amplitude_m * (2.0 * tap - 1.0), share) + trembles, 0,
                0};
    }
    LoopResult run() const {
        LoopCase c = loop;
        c.device = &device;
        const auto place = [this](double t) { return at(t); };
        return slides ? close_loop(c, 3.0, 10.0, place, vibration_n, wall)
                      : close_loop(c, 3.0, 10.0, place, vibration_n);
    }
};
inline std::ostream& operator<<(std::ostream& out, const OtherHand& h) {
    return out << h.loop
               << (h.slides ? h.turns ? ": slides to and fro at " : ": slides at " : ": taps at ")
               << (h.slides ? 1e3 * h.speed_m_per_s : 1e3 * h.amplitude_m)
               << (h.slides ? " mm/s, waves of " : " mm, ")
               << (h.slides ? 1e3 * h.wall.wave_m : 0.0) << " mm, " << h.hertz << " Hz, vibration "
               << h.vibration_n;
}
inline OtherHand other_hand(uint64_t seed) {
    Drawn drawn(seed);
    OtherHand hand{.device = other_device(drawn)};
    LoopCase& c = hand.loop;
    c.preset = "drawn";
    c.rate_hz = drawn.evenly_by_size(100.0, 10000.0);
    c.delay_s = drawn.one_in(2) ? 0.0 : drawn.between(0.0, 0.002);
    hand.device.capabilities.delay_s = c.delay_s;
    c.grip = drawn.between(0.8, 3.0);
    c.stiffness_n_per_m =
        drawn.between(0.1, 0.5) *
        std::min(4000.0, most_stiffness_n_per_m({}, hand.device.capabilities, c.rate_hz));
    hand.slides = drawn.one_in(2);
    hand.turns = drawn.one_in(2);
    hand.hertz = drawn.between(0.8, hand.slides ? 4.0 : 7.0);
    hand.uneven = drawn.between(0.0, 1.0);
    hand.speed_m_per_s = drawn.between(0.02, 0.35);
    hand.amplitude_m =
        drawn.between(1e-3, std::min(12e-3, 0.3 / (2.0 * std::numbers::pi * hand.hertz)));
    hand.middle_m =
        hand.slides ? drawn.between(1e-3, 5e-3) : drawn.between(-0.8, 1.2) * hand.amplitude_m;
    hand.wall = {.height_m = drawn.between(0.02e-3, 0.3e-3), .wave_m = drawn.between(1e-3, 12e-3)};
    hand.tremor_m = drawn.one_in(2) ? 0.0 : drawn.between(0.0, 0.1e-3);
    hand.vibration_n = drawn.one_in(3) ? drawn.between(0.05, 0.5) : 0.0;
    return hand;
}

} // namespace palpate::haptics
