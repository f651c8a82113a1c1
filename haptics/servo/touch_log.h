#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "haptics/servo/servo.h"

namespace palpate::haptics {

// A run of the servo, for people and programs. Times count from start_ns; ticks before it are left
// out.

// Columns: time_s, probe_x_mm .. z, proxy_x_mm .. z, force_x_n .. z (as sent, in the world's axes),
// energy_mj, cpu_us, volume_version, depth_mm, normal_x .. z, contact (free, touching, yielding,
// submerged, unknown), share (of soft start), faults (names joined by '+'), buttons, rendered_x_n
// .. z (what the safety chain was given, in the world's axes), damping_n (the size of what the
// safety chain added to it), torque_x_nm .. z (as sent, in the device's axes), label (that is
// touched; 0: none).
std::string touch_csv(std::span<const ServoTick> ticks, int64_t start_ns);

struct TouchSummary {
    uint64_t ticks = 0, contact_ticks = 0;
    double most_force_n = 0.0, most_depth_mm = 0.0;
    double energy_mj = 0.0;      // at the end; > 0: the loop has made energy
    double largest_step_n = 0.0; // of force from one tick to the next
    uint32_t faults = 0;         // all that were seen
    // When force was let out first, after start_ns; none before that, infinite: never.
    double began_s = 0.0;
};
TouchSummary summarise(std::span<const ServoTick> ticks, int64_t start_ns);

} // namespace palpate::haptics
