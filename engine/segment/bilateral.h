#pragma once

#include "engine/segment/brick_maker.h"

namespace palpate {

// Edge-preserving smoothing (Tomasi and Manduchi 1998), f32:
//   v(p) + sum w (v(q) - v(p)) / sum w,  w = exp(-|p - q|^2 / 2 s^2 - (v(p) - v(q))^2 / 2 r^2)
// over the samples q of a ball of kBilateralReach * s about p; lengths are world mm on every grid.
// Samples without data take no part and stay without data. Beyond the volume its outermost samples
// go on.
//
// Exact: weights are right to 5e-6 of themselves (a polynomial for the exponential), so the
// result errs by at most 1e-5 of the span of values in the ball, beside the ball's end: outside lie
// 2.9 % of a Gaussian's weight in 3D, which the exact bilateral filter without an end would add.
//
// Separable: one-dimensional filters along x, y and z, each on the result of the one before (Pham
// and van Vliet 2005): some 20 times as fast, not symmetric in the axes, and coarser where edges
// are slanted or thin. docs/reference/filters.md states how far it is from the exact one.
//
// Memory: a brick and its halo for each thread.
struct BilateralOptions {
    double sigma_mm = 1.0; // > 0, reach at most 24 samples
    double range = 50.0;   // r, in value units; > 0
    bool separable = false;
};
constexpr double kBilateralReach = 3.0;

Result<BrickMaker> bilateral_bricks(const Volume& volume, const BilateralOptions& options);
Result<Volume> bilateral(const Volume& volume, const BilateralOptions& options, const Task& task);

} // namespace palpate
