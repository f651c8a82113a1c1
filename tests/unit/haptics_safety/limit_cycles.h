#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <memory>
#include <numbers>
#include <type_traits>

#include "haptics/device/simulated.h"
#include "haptics/safety/chain.h"

// A wall, a hand and a device whose forces act late, closed through the safety chain. The device
// states its delay, or states none.
namespace palpate::haptics {

struct LoopCase {
    const char* preset = "ideal";
    double rate_hz = 1000.0, delay_s = 0.0, stiffness_n_per_m = 1000.0, grip = 1.0;
    bool is_told = true;
    const DevicePreset* device = nullptr; // another one than that of the name
    const DevicePreset& of() const { return device ? *device : *find_device_preset(preset); }
};
inline std::ostream& operator<<(std::ostream& out, const LoopCase& c) {
    return out << c.preset << ' ' << c.rate_hz << " Hz, " << 1e3 * c.delay_s << " ms"
               << (c.is_told ? " told, " : " not told, ") << c.stiffness_n_per_m << " N/m, grip "
               << c.grip;
}

// The place where the hand means to be by a function of time: along x, or anywhere.
template <class Place>
class HandAlong final : public HandSource {
 public:
    explicit HandAlong(Place place) : place_(place) {}
    Meant meant(double time_s) noexcept override {
        constexpr double kStep_s = 1e-5;
        return {at(time_s), (at(time_s + kStep_s) - at(time_s - kStep_s)) / (2.0 * kStep_s)};
    }
    Held held(double) noexcept override { return {}; }

 private:
    glm::dvec3 at(double time_s) const {
        if constexpr (std::is_same_v<decltype(place_(time_s)), double>)
            return {place_(time_s), 0, 0};
        else
            return place_(time_s);
    }
    Place place_;
};

// Solid places: x > 0; or x above waves along y, which push a hand that slides by both axes.
struct FlatWall {
    glm::dvec3 force_n(glm::dvec3 x, double k) const { return {-k * std::max(0.0, x.x), 0, 0}; }
};
struct WavyWall {
    double height_m, wave_m;
    glm::dvec3 force_n(glm::dvec3 x, double k) const {
        const double turn = 2.0 * std::numbers::pi / wave_m;
        const double depth_m = std::max(0.0, x.x - height_m * std::sin(turn * x.y));
        return k * depth_m * glm::dvec3(-1.0, height_m * turn * std::cos(turn * x.y), 0.0);
    }
};

// Swings of the handle: from one turn to the next.
class Swings {
 public:
    // Large: at least so much way, under a force that changes by so much.
    enum class Ended { none, small, large };
    Ended ends(double x_m, double force_n) {
        least_n_ = std::min(least_n_, force_n);
        most_n_ = std::max(most_n_, force_n);
        if ((x_m - extreme_m_) * towards_ > 0.0)
            extreme_m_ = x_m;
        if ((extreme_m_ - x_m) * towards_ < 0.25 * kLeast_m)
            return Ended::none;
        const bool is_large =
            std::abs(extreme_m_ - turn_m_) > kLeast_m && most_n_ - least_n_ > kLeast_n;
        turn_m_ = extreme_m_;
        extreme_m_ = x_m;
        towards_ = -towards_;
        least_n_ = most_n_ = force_n;
        return is_large ? Ended::large : Ended::small;
    }
    static constexpr double kLeast_m = 2e-3, kLeast_n = 1.0;

 private:
    double extreme_m_ = 0.0, turn_m_ = 0.0, towards_ = 1.0, least_n_ = 0.0, most_n_ = 0.0;
};

struct LoopResult {
    // Large swings under force, one after the other, while the hand rests: when the second ended,
    // and the last.
    double begun_s = -1.0, last_s = -1.0;
    double fault_s = -1.0;           // the first latched fault
    uint32_t faults = 0;             // then
    double damped_s = -1.0;          // the first tick that said that swings are damped
    double most_made_j = 0.0;        // work of the motors and what the spring has still to give
    double after_fault_j = 0.0;      // work of the motors later than the delay after it
    double end_m = 0.0, end_n = 0.0; // peak to peak in the last 0.3 s
    double most_n = 0.0;             // that was sent
};

// The hand means nothing new from rests_s on.
template <class Place, class Wall = FlatWall>
LoopResult close_loop(const LoopCase& c, double length_s, double rests_s, Place place,
                      double vibration_n = 0.0, Wall wall = {}) {
    DevicePreset preset = c.of();
    preset.capabilities.rate_hz = c.rate_hz;
    preset.capabilities.delay_s = c.is_told ? c.delay_s : 0.0;
    SimulatedDevice device(preset, {.grip = c.grip}, std::make_shared<HandAlong<Place>>(place));
    SafetyLimits limits;
    limits.ramp_s = 0.1;
    SafetyChain chain(limits, device.capabilities(), c.rate_hz);
    chain.arm();
    const double k = std::min(c.stiffness_n_per_m,
                              most_stiffness_n_per_m(limits, preset.capabilities, c.rate_hz));
    const auto period_ns = std::llround(1e9 / c.rate_hz), delay_ns = std::llround(1e9 * c.delay_s);
    std::deque<std::pair<int64_t, Wrench>> under_way;
    const auto deliver = [&](int64_t now_ns) {
        for (; !under_way.empty() && under_way.front().first <= now_ns; under_way.pop_front())
            device.write(under_way.front().first, under_way.front().second);
    };
    LoopResult result;
    DeviceSample sample;
    Swings swings;
    int in_turn = 0;
    double low_m = 1.0, high_m = -1.0, low_n = 1e9, high_n = -1e9, fault_j = 0.0;
    uint64_t random = 1;
    for (int64_t now = 0; now < std::llround(1e9 * length_s); now += period_ns) {
        const double t = 1e-9 * static_cast<double>(now);
        deliver(now);
        const DeviceStatus status = device.read(now, sample);
        const SafetyChain::Begun begun = chain.begin(now, now, status, sample);
        glm::dvec3 force_n = wall.force_n(begun.sample.position_m, k);
        if (force_n.x < 0.0 && vibration_n > 0.0) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            force_n.x += vibration_n * (static_cast<double>(random >> 11) * 0x1p-52 - 1.0);
        }
        const Wrench sent = chain.finish({force_n, {}}, k);
        under_way.emplace_back(now + delay_ns, sent);
        deliver(now);
        if ((chain.faults() & kFaultDamped) && result.damped_s < 0.0)
            result.damped_s = t;
        if (chain.latched() && result.fault_s < 0.0) {
            result.fault_s = t;
            result.faults = chain.faults();
        }
        const double x = device.true_position_m().x, work_j = device.motor_work_j();
        result.most_made_j =
            std::max(result.most_made_j,
                     work_j + stored_energy_j(k * std::max(0.0, x), k, chain.most_force_n()));
        result.most_n = std::max(result.most_n, std::abs(sent.force_n.x));
        if (result.fault_s < 0.0 || t < result.fault_s + c.delay_s + 1.0 / c.rate_hz)
            fault_j = work_j;
        result.after_fault_j = std::max(result.after_fault_j, work_j - fault_j);
        const Swings::Ended ended = swings.ends(x, sent.force_n.x);
        if (ended == Swings::Ended::small)
            in_turn = 0;
        else if (ended == Swings::Ended::large && t > rests_s && ++in_turn >= 2) {
            result.last_s = t;
            if (result.begun_s < 0.0)
                result.begun_s = t;
        }
        if (t > length_s - 0.3) {
            low_m = std::min(low_m, x);
            high_m = std::max(high_m, x);
            low_n = std::min(low_n, sent.force_n.x);
            high_n = std::max(high_n, sent.force_n.x);
        }
    }
    result.end_m = high_m - low_m;
    result.end_n = high_n - low_n;
    return result;
}

// From 5 mm before the wall into it, within 0.2 s, to stay.
inline LoopResult press_and_hold(const LoopCase& c, double length_s = 2.0) {
    return close_loop(c, length_s, 0.5, [](double t) {
        return -5e-3 + 15e-3 * std::clamp((t - 0.3) / 0.2, 0.0, 1.0);
    });
}

inline bool is_stiffer_than_its_maker_says(const LoopCase& c) {
    return c.stiffness_n_per_m > 1.01 * c.of().capabilities.max_stiffness_n_per_m;
}

} // namespace palpate::haptics
