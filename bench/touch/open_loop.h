#pragma once

#include <functional>

#include "bench/touch/figures.h"
#include "bench/touch/trajectories.h"

namespace palpate::touch {

// Moves the tool along a path whatever the force says, one tick a point, and judges every tick.
// parameters.tool_radius_mm says what ball the true force is that of. `watch`, where given, sees
// each tick's input and output; `timed` measures the thread's CPU clock about each tick.
Figures open_loop(
    haptics::Algorithm& algorithm, const Scene& scene, const Trajectory& trajectory,
    const haptics::TouchParameters& parameters, bool timed = false,
    const std::function<void(const haptics::TickInput&, const haptics::TickOutput&)>& watch = {});

// Shows an algorithm, and its judge, what a scene is at each tick: one stage after the other.
class Player {
 public:
    explicit Player(const Scene& scene) : scene_(scene) {}
    void next(Judge& judge, haptics::TickInput& input);

 private:
    const Scene& scene_;
    size_t tick_ = 0, stage_ = 0;
};

// The parameters a scene is touched with: its iso-value, 1 N/mm, no friction, no yielding.
haptics::TouchParameters scene_parameters(const Scene& scene);

double thread_cpu_us();

} // namespace palpate::touch
