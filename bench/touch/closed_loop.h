#pragma once

#include <functional>
#include <memory>

#include "bench/touch/figures.h"
#include "bench/touch/trajectories.h"
#include "haptics/device/simulated.h"

namespace palpate::touch {

// A loop closed through a simulated device with a hand on it.
struct LoopResult {
    Figures figures;      // judged at what the device reported
    double work_mj = 0.0; // of the motors on handle and hand; > 0: the loop made energy
    double held_mj = 0.0; // by the spring at the end
    double largest_sent_n = 0.0;
    double limit_cycle_mm = 0.0;  // peak to peak of the true position in the last 0.5 s, any axis
    double settled_force_n = 0.0; // mean size in that time
};

// A device with a hand on it, and the mechanics behind its samples.
class HeldDevice {
 public:
    virtual ~HeldDevice() = default;
    virtual void wait(int64_t until_ns) = 0; // on the clock of the path, which begins at 0
    virtual haptics::HapticDevice& device() = 0;
    virtual const haptics::SimulatedDevice& plant() const = 0;
};

struct Loop {
    const haptics::DevicePreset* device = nullptr; // of device_presets()
    haptics::HandModel hand;
    double tick_s = kTick_s;
    // Whether the magnitude of force is limited and energy watched as by the safety chain.
    bool is_controlled = false;
    // Makes the device in place of the simulated one, such as a driver on a model of its hardware.
    std::function<std::unique_ptr<HeldDevice>(const haptics::HandPath& path,
                                              const haptics::HandModel& hand)>
        make_held = nullptr;
};

// The hand means to follow the path (one point a millisecond); the device's plant, steps and delay
// come between. Positions are the world's, one millimetre to one of the hand; forces are written in
// the tick that read the position.
LoopResult closed_loop(haptics::Algorithm& algorithm, const Scene& scene, const Path& path,
                       const haptics::TouchParameters& parameters, const Loop& loop);

// Whether a hold against a plane settles: a limit cycle of at most 50 um.
struct ZWidthCell {
    double stiffness_n_per_m = 0.0, damping_n_s_per_m = 0.0;
    bool stable = false;
    double limit_cycle_mm = 0.0;
};
// `columns` stiffnesses from 500 N/m on, times the root of 2 each, times `rows` dampings from 0 on.
std::vector<ZWidthCell> z_width(const char* algorithm, const haptics::DevicePreset& device,
                                uint32_t columns, uint32_t rows);

} // namespace palpate::touch
