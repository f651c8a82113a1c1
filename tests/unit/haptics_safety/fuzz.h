#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "haptics/safety/chain.h"

namespace palpate::haptics {

// Runs a safety chain for `ticks` ticks on ordinary and on arbitrary input: any sample, status,
// clock, force, stiffness, halts and yeses, one tick in 500 each wild. Whatever comes in, what goes
// out is finite, within limits, grows and turns no faster than it may, is nothing in the tick after
// a halt, and is nothing while a fault but the velocity trip's is latched; that one's ends within
// 30 ticks.
inline void fuzz_chain(uint64_t seed, uint64_t ticks) {
    constexpr int64_t kMs = 1'000'000;
    const DeviceCapabilities device{.workspace_m = glm::dvec3(0.05),
                                    .resolution_m = 50e-6,
                                    .max_force_n = 8.0,
                                    .max_torque_nm = 0.1,
                                    .max_damping_n_s_per_m = 20.0};
    const SafetyLimits limits{.ramp_s = 0.05}; // so that it is on for most of the time
    std::mt19937_64 random(seed);
    constexpr double kInf = std::numeric_limits<double>::infinity();
    const double odd[] = {0.0,    -0.0,   1e-310, 0.01,  -0.03,
                          0.05,   1.0,    -3.0,   1e9,   1e300,
                          -1e300, 5e-324, kInf,   -kInf, std::numeric_limits<double>::quiet_NaN()};
    const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    const auto vector = [&](double scale) {
        const auto number = [&] {
            return random() % 4 ? scale * (2.0 * share() - 1.0) : odd[random() % std::size(odd)];
        };
        const double x = number(), y = number(), z = number();
        return glm::dvec3(x, y, z);
    };
    SafetyChain chain(limits, device);
    int64_t now_ns = 0, last_ns = 0;
    uint64_t sent = 0;
    int since_latch = 0;
    glm::dvec3 before(0.0), place(0.0), speed(0.0);
    for (uint64_t tick = 0; tick < ticks; ++tick) {
        const uint64_t wild = random() % 500 ? 0 : random(); // each bit makes one thing wild
        if (chain.mode() == SoftStart::Mode::disarmed || (since_latch > 40 && random() % 8 == 0) ||
            wild & 1)
            chain.arm();
        const bool halted = wild & 2;
        if (halted)
            chain.halted();
        now_ns += wild & 4 ? static_cast<int64_t>(random()) >> (8 + random() % 40) : kMs;
        now_ns = std::clamp(now_ns, -(int64_t{1} << 60), int64_t{1} << 60);
        const int64_t due_ns = wild & 8 ? static_cast<int64_t>(random()) >> 8 : now_ns;
        speed += 0.01 * (0.3 * glm::dvec3(share() - 0.5, share() - 0.5, share() - 0.5) - speed);
        const glm::dvec3 velocity = 10.0 * speed; // as a hand's, not reversed at every tick
        place = glm::clamp(place + 1e-3 * velocity, -0.05, 0.05);
        DeviceSample sample{.time_ns = wild & 2048 ? static_cast<int64_t>(random()) : now_ns,
                            .position_m = wild & 16 ? vector(0.1) : place,
                            .velocity_m_per_s = wild & 32 ? vector(10) : velocity};
        if (wild & 64)
            sample.rotation = {share(), kInf, 0, 0};
        const auto status = wild & 128 ? static_cast<DeviceStatus>(random() % 5) : DeviceStatus::ok;
        chain.begin(now_ns, due_ns, status, sample);
        // A chain that waits to start is offered quiet.
        const double most = chain.mode() == SoftStart::Mode::waiting ? 0.1 : 20.0;
        Wrench wanted{{most * (share() - 0.5), most * (share() - 0.5), 0}, {0, 0.3 * share(), 0}};
        if (wild & 256)
            wanted.force_n = vector(1e3);
        if (wild & 512)
            wanted.torque_nm = vector(1);
        const double stiffness =
            wild & 1024 ? std::abs(odd[random() % (std::size(odd) - 3)]) : 1000.0;
        const Wrench out = chain.finish(wanted, stiffness);

        const double size = glm::length(out.force_n), torque = glm::length(out.torque_nm);
        ASSERT_TRUE(std::isfinite(size) && size <= 0.8 * 8.0 * (1 + 1e-12)) << tick;
        ASSERT_TRUE(std::isfinite(torque) && torque <= 0.8 * 0.1 * (1 + 1e-12)) << tick;
        const double dt_s = std::clamp(1e-9 * static_cast<double>(now_ns - last_ns), 1e-5, 0.1);
        // Between forces of one size, rounding apart, the limit is that of falling ones.
        if (size > glm::length(before) * (1 + 1e-9)) {
            ASSERT_LE(glm::distance(out.force_n, before), 2000.0 * dt_s * (1 + 1e-9) + 1e-12)
                << tick;
        }
        // The part that is new beside the force before, let go in part: growth, or a turn.
        const double was = glm::length(before);
        const glm::dvec3 direction = was > 0.0 ? before / was : glm::dvec3(0.0);
        const double kept = std::clamp(glm::dot(out.force_n, direction), 0.0, was);
        ASSERT_LE(glm::distance(out.force_n, kept * direction), 2000.0 * dt_s * (1 + 1e-9) + 1e-9)
            << tick;
        if (halted) {
            ASSERT_EQ(out, Wrench{}) << tick;
        }
        const uint32_t faults = chain.faults() & kFaultLatched;
        since_latch = faults ? since_latch + 1 : 0;
        if ((faults & ~uint32_t{kFaultVelocity}) || since_latch > 30) {
            ASSERT_EQ(out, Wrench{}) << tick << ' ' << fault_text(faults);
        }
        if (wild & 4096)
            chain.written(static_cast<DeviceStatus>(random() % 5));
        before = out.force_n;
        last_ns = now_ns;
        sent += size > 1.0;
    }
    EXPECT_GT(sent, ticks / 4); // it was on for a good part of the time
}

} // namespace palpate::haptics
