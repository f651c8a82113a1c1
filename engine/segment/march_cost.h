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

// The values of an object as far as the seeds of a label and what lies around them tell: those
// under its seeds, but
// - seeds on a blurred edge count where they settle beside it (settled_seeds);
// - fewer than kFewSeeds samples tell neither mean nor spread. The noise is then 1.05 medians of
//   the differences of neighbours beside the seeds (a normal distribution's standard deviation),
//   and neighbours within three standard deviations of a difference count as seeds;
// - the spread is at least a tenth of the object's contrast. Where values are even, an edge that is
//   a few samples wide would be slow at its foot already. The object is here what joins the seeds
//   within `deviations` of the spread. Of each face between it and what lies around, the contrast
//   is how far values rise or fall on from the mean, sample by sample of the smoothed volume; a
//   fifth of the faces has less than the object's.
// `deviations` is above 0; `balls` are those of the seed file, of any label. Values and contrast
// are in the volume's units. Without a seed of the label the result counts 0 samples. Errors: those
// of region_growing, and that the task was stopped.
constexpr uint64_t kFewSeeds = 27;
struct ObjectValues {
    SeedValues values;
    double contrast = 0.0; // 0 where the object has no faces
};
Result<ObjectValues> object_values(const Volume& volume, const Volume& seeds, uint16_t label,
                                   std::span<const SeedBall> balls, double deviations,
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
