#pragma once

#include <optional>

#include "haptics/servo/pace.h"
#include "tests/unit/haptics_falcon/falcon_bench.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// The whole loop on the model of a Falcon: bytes, driver, safety chain, servo, pace. Solid is below
// z = 0 of the device.
namespace palpate::haptics::falcon {

inline Servo::Options quick_start() {
    Servo::Options options;
    options.limits.ramp_s = 0.1; // so that force is there after 0.2 s
    return options;
}

struct FalconLoop {
    Loop loop;
    Pace pace;

    // `clock`: of the device's transport.
    FalconLoop(std::unique_ptr<HapticDevice> device, VirtualClock& clock, double stiffness_n_per_m,
               const Servo::Options& options = quick_start())
        : loop({}, {.stiffness_n_per_m = stiffness_n_per_m}, std::make_unique<WallAlgorithm>(),
               std::move(device), options),
          pace(*loop.device, 1000.0, clock) {}
    ServoTick tick() {
        const Pace::Beat beat = pace.next();
        return loop.servo.tick(beat.now_ns, beat.due_ns);
    }
};

// 8 mm above the wall until 0.3 s, then to 4 mm below it within 0.1 s.
inline HandPath press_path(double begin_s = 0.3) {
    return HandPath({{.time_s = 0, .tool = {.position_mm = {0, 0, 8}}},
                     {.time_s = begin_s, .tool = {.position_mm = {0, 0, 8}}},
                     {.time_s = begin_s + 0.1, .tool = {.position_mm = {0, 0, -4}}}});
}

} // namespace palpate::haptics::falcon
