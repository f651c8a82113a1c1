#pragma once

#include "engine/segment/seed_values.h"
#include "engine/segment/task.h"
#include "engine/volume/volume.h"

// Costs of fast marching: f32 on the volume's grid, time units per mm, above 0 and at most
// kLargestCost. Where the volume has no data, the cost has none, which is a wall.
namespace palpate {

constexpr double kLargestCost = 1e4;

// From edges (Vidholm & Agmund 2004, section 6: fast where the gradient magnitude is low):
//     C = exp(|grad V| / edge)
// with the gradient of edge_strength() and `edge` > 0, both in value units per mm. The print
// smooths the volume before and names no formula; this is the inverse of Malladi, Sethian &
// Vemuri's speed (1995).
Result<Volume> edge_cost(const Volume& volume, double edge, const Task& task);

// The mean gradient magnitude under the seeds of a label, for `edge`; 1 where it is 0.
Result<double> edge_under_seeds(const Volume& volume, const Volume& seeds, uint16_t label,
                                const Task& task);

// From the grey values under the seeds (Nystroem et al. 2008, section 3.3: "based on gray-level
// statistics of the seed-regions", no formula is printed):
//     C = floor + ((V - mean) / (deviations * sd))^2
// with the seeds' mean and standard deviation (spread_of), `deviations` > 0 and `floor` > 0. V is
// first smoothed by (1 2 1) / 4 along each axis `passes` times, as noise of single samples holds a
// front up everywhere; neighbours without data are left out.
struct StatisticsCostOptions {
    double deviations = 2.5, floor = 0.01;
    int passes = 1; // 0 .. 10
};
Result<Volume> statistics_cost(const Volume& volume, const SeedValues& seeds,
                               const StatisticsCostOptions& options, const Task& task);

} // namespace palpate
