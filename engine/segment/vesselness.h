#pragma once

#include "engine/segment/brick_maker.h"

namespace palpate {

// Eigenvalues of the symmetric matrix with the diagonal (xx, yy, zz), ascending. Closed form (Smith
// 1961) in double; within 1e-7 of the largest entry, the worst where two of them coincide.
glm::dvec3 eigenvalues(double xx, double yy, double zz, double xy, double xz, double yz);

// How much the surroundings of a sample look like a tube: 0 .. 1, f32 (Frangi, Niessen, Vincken and
// Viergever 1998). H is the matrix of second derivatives in the world of the volume smoothed by a
// Gaussian of s mm, times s^2; its eigenvalues |a| <= |b| <= |c|. For bright tubes it is 0 where b
// or c is above 0 (for dark ones below), else
//   (1 - exp(-(b/c)^2 / 2 alpha^2)) exp(-a^2 / (2 beta^2 |b c|)) (1 - exp(-|H|^2 / 2 structure^2)),
// |H|^2 = a^2 + b^2 + c^2; the largest of all scales. Smoothing, border and no-data: gaussian.h.
//
// Memory: a brick and its halo for each thread.
struct VesselnessOptions {
    double from_mm = 1.0, to_mm = 1.0; // scales s: `steps` from one to the other, in even ratios
    int steps = 1;                     // 1 .. 32; 1: from_mm alone
    double alpha = 0.5, beta = 0.5;    // > 0
    // In value units. Absent: half the largest |H| of the volume and all scales, found in a pass of
    // its own, as the authors advise.
    std::optional<double> structure;
    bool dark = false;
};

Result<BrickMaker> vesselness_bricks(const Volume& volume, const VesselnessOptions& options,
                                     const Task& task);
Result<Volume> vesselness(const Volume& volume, const VesselnessOptions& options, const Task& task);

} // namespace palpate
