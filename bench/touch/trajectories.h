#pragma once

#include <string>
#include <vector>

#include "bench/touch/scenes.h"

namespace palpate::touch {

// The places that the hand wants to be at, tick by tick.
using Path = std::vector<glm::dvec3>; // world mm

constexpr double kTick_s = 1e-3;

struct Trajectory {
    std::string id;   // "T1" .. "T10", of the test plan
    std::string name; // "press/20mm_s"
    Path path;
    bool judge_jumps = true;     // steps are small enough for jumps to mean something
    bool judge_direction = true; // the tool moves as hands do: no leaps of centimetres in a tick
    double tick_s = kTick_s;     // from one point to the next
};

// The motions of the plan for a body, about its touched point: press, hold and release; sinusoids;
// straight crossings; a Lissajous slide; a circle (round corners, too); a smooth hand with tremor;
// a random walk with jumps; noise; encoder steps; lost, repeated and swapped samples. Every one
// begins in free space. `ticks` bounds each; all random numbers come from `seed`.
std::vector<Trajectory> trajectories(const TouchCase& body, size_t ticks, uint64_t seed, bool all);

// Single ones, for tests.
Path press(const TouchCase& body, double speed_mm_s, double depth_mm, double hold_s);
Path crossing(const TouchCase& body, double speed_mm_s, double reach_mm);
Path slide(const TouchCase& body, double depth_mm, double width_mm, double seconds);
Path hand(const TouchCase& body, double depth_mm, double seconds, uint64_t seed);
Path walk(const TouchCase& body, double largest_jump_mm, size_t ticks, uint64_t seed);
Path quantised(Path path, double step_mm);

} // namespace palpate::touch
