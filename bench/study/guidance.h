#pragma once

#include "engine/base/json.h"
#include "engine/segment/task.h"

namespace palpate::bench {

// The worth of guidance (haptics/proxy/guide.h) to a simulated hand, on abdomens of
// liver_phantom(): a hand with a simulated device, the whole servo with its safety chain, on a
// virtual clock. The hand misses what it means: an aim, or a slow wander along a line, and tremor.
// Such sizes are assumptions, measured on nobody.
struct GuidanceOptions {
    uint64_t first_phantom = 0; // numbers of those on which parameters are chosen are others
    uint32_t phantoms = 12;
    uint32_t seeds = 24; // placed in each near the liver's surface, held in by the distance to what
                         // fast marching finds from other seeds
    uint32_t repeats = 4; // of a line drawn along the liver's edge, and of one within a plane
    double stiffness_n_per_m = 500.0, largest_n = 3.0; // of the guides
};

// "rows": one a task and a state of the force (off, on). A function of its options.
//   seeds: "outside_share" of the liver where the hand clicks, and where the proxy is
//   edge, plane: mean and 95th percentile of the distance in mm between what was drawn (at the
//          proxy, and by the hand) and the true surface or the plane; "apart_mm": root mean square
//          distance of two drawings of one line at the same time
// "largest_energy_mj": of the work on the hand since the start of a trial, over all ticks; a trial
// begins where no force is, so above 0 the loop made energy. "largest_force_n".
Result<Json> guidance_study(const GuidanceOptions& options, const Task& task);

} // namespace palpate::bench
