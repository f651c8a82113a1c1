#pragma once

#include "engine/segment/flood.h"
#include "engine/segment/seed_values.h"
#include "engine/segment/task.h"

// Speeds of level sets from grey values: f32 on the volume's grid, -1 .. 1, no data where the
// volume has none.
namespace palpate {

// 1 in the middle of an interval of values, 0 at its ends and falling as fast beyond, down to -1:
//     P = 1 - |V - (low + high) / 2| / ((high - low) / 2)
// (Lefohn, Cates & Whitaker 2003; itk::ThresholdSegmentationLevelSetFunction, which does not scale
// to 1 nor end at -1: there the farthest value of the volume dictates the time step).
// interval: finite, low < high.
Result<Volume> threshold_speed(const Volume& volume, const ValueInterval& interval,
                               const Task& task);

// The edge indicator of geodesic active contours, 0 .. 1 and small on edges:
//     Z = 1 / (1 + (|grad G * V| / edge)^exponent)
// with G a Gaussian of sigma_mm and `edge` > 0 in value units per mm (Malladi, Sethian & Vemuri
// 1995; Caselles et al. 1997; ITK-SNAP, Yushkevich et al. 2006, its first equations).
struct EdgeSpeedOptions {
    double edge = 1.0, exponent = 2.0, sigma_mm = 1.0;
};
Result<Volume> edge_speed(const Volume& volume, const EdgeSpeedOptions& options, const Task& task);

// 0 where the smoothed edge is steepest, for a surface near it whose signed distance is given:
// above 0 on the surface's inner side, below 0 on the outer one, 0 far from the surface and where
// there is no edge. With f the volume smoothed by sigma_mm, g its gradient and H its second
// derivatives, the length of g that an edge has at least being `edge` and h the smallest spacing:
//     P = +-2 h (g . H g / |g|^2) / |g| * (1 - Z),  at least -1 and at most 1.
// On an edge that is S wide (standard deviation of its profile in f) a surface comes nearer by
// exp(-2 h t / S^2) in a time t.
Result<Volume> edge_place_speed(const Volume& volume, const Volume& distance,
                                const EdgeSpeedOptions& options, const Task& task);

// How far smoothing has moved an edge inward: by sigma^2 / radius on a ball, whatever the edge's
// profile. (u = r f obeys the heat equation in one dimension, so that a profile e(r) becomes, but
// for its own smoothing, e + (sigma^2 / r) e'.) In mm, by half of sigma^2 times the sum of the
// principal curvatures of f's surfaces, at most sigma / 2; 0 where there is no edge or no surface.
Result<Volume> edge_shift_mm(const Volume& volume, const Volume& distance,
                             const EdgeSpeedOptions& options, const Task& task);

// Region competition as ITK-SNAP has it (Zhu & Yuille 1996): the probability that a sample is
// inside less that it is outside, here by Bayes' rule with equal priors and normal distributions of
// the values under both kinds of seeds,
//     P = (p_in - p_out) / (p_in + p_out),  p = exp(-((V - mean) / sd)^2 / 2) / sd.
Result<Volume> region_speed(const Volume& volume, const SeedValues& inside,
                            const SeedValues& outside, const Task& task);

} // namespace palpate
