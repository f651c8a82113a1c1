#pragma once

#include "engine/segment/brick_maker.h"

namespace palpate {

enum class ResampledBy {
    nearest, // the nearest sample, in the type of the input: for labels
    linear,  // f32
    cubic,   // f32: the cubic B-spline through the samples (Unser, Aldroubi and Eden 1993)
};

// A volume on another grid: its samples are those of the input at the same place of the patient.
//
// Inside is up to half a sample beyond the outermost sample centres of the input, where the
// outermost samples go on; farther out there is no data (nearest: `outside`). A point whose nearest
// sample has no data has none; elsewhere samples without data take no part (linear), or count as
// the nearest sample does (cubic). Grids coarser than the input pick samples and do not average:
// smooth first.
//
// cubic: coefficients by the recursive filter's impulse response sqrt(3) (sqrt(3) - 2)^|k|, cut at
// 12 samples: 1.4e-7 of a value.
//
// Memory: a block of the result and the input beneath it, at most 200 MB, for each thread.
struct ResampleOptions {
    Grid grid;
    ResampledBy interpolation = ResampledBy::linear;
    double outside = 0; // nearest only; a value the type holds
};

// The grid with samples spacing_mm apart (> 0) along the same axes that covers the same box: from
// half a sample before the first to half a sample behind the last, or more where the length is no
// multiple. The middle stays.
Result<Grid> grid_of_spacing(const Grid& grid, glm::dvec3 spacing_mm);

Result<BrickMaker> resample_bricks(const Volume& volume, const ResampleOptions& options);
Result<Volume> resample(const Volume& volume, const ResampleOptions& options, const Task& task);

} // namespace palpate
