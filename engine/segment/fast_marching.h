#pragma once

#include <limits>
#include <span>
#include <vector>

#include "engine/segment/seeds.h"
#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

// The places where a front starts, at time 0.
struct MarchStart {
    const Volume* seeds = nullptr; // a label map on the cost's grid: the centres of its samples
    uint16_t label = 0;            // of those of this label; 0: of any
    // Balls, and points of radius 0 between samples too; their labels do not count. Arrival beside
    // one is exact where cost is constant: near it the distance, not its differences, is taken.
    std::span<const SeedBall> balls;
};

struct FastMarchingOptions {
    int order = 2;                                            // 1 as printed, or 2
    float last_time = std::numeric_limits<float>::infinity(); // later samples stay unreached
};

// Time of arrival of a front that moves with speed 1 / cost along its normal: |grad u| = cost
// (Vidholm & Agmund 2004, section 6; Nystroem et al. 2008, section 3.3; Sethian 1999).
//
// cost: f32, time units per mm, >= 0; infinite or no data: a wall. The result is f32 on its grid,
// in time units; no data where the front does not arrive. Distances are world mm by the grid's
// spacing, whose axes may be turned but not sheared.
//
// First order: one-sided differences over one sample. Second order: over two, where the second
// neighbour arrives before the first. Samples are settled in windows of time about as long as the
// front takes for a sample, and relaxed within a window until none changes; so the result of first
// order is the solution of the upwind equations, as a heap gives it. Windows are worked on by
// bricks on all threads, in rounds between which bricks exchange what lies at their faces: the
// number of threads changes no bit. Memory: 7.1 bytes a sample of reached bricks, beside cost and
// result.
//
// Refused, in one sentence: sheared grids, a cost below 0 or of another type, no start or none
// where the cost is finite, and seeds of another size.
Result<Volume> fast_marching(const Volume& cost, const MarchStart& start,
                             const FastMarchingOptions& options, const Task& task);

} // namespace palpate
