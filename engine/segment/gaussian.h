#pragma once

#include <array>

#include "engine/segment/brick_maker.h"

// Gaussian smoothing and derivatives of the smoothed volume, f32.
//
// sigma is in mm along each of the grid's axes; the kernels, their truncation and their errors are
// in kernel.h. Where the axes are sheared, the blurred point is the product of the three along the
// slanted axes, whose covariance is sigma^2 (a a' + b b' + c c') with the axes' unit vectors: an
// ellipsoid, and a ball where they are at right angles. Derivatives are taken in world space from
// all three axes, so they point the right way on every grid.
//
// Beyond the volume its outermost samples go on. A sample without data stays without data and takes
// no part in others: the weights of those that have data are scaled up (normalised convolution,
// Knutsson and Westin 1993), and derivatives are the derivatives of that quotient.
//
// Memory: the result; of the input, a brick and its halo for each thread.
namespace palpate {

struct GaussianOptions {
    double sigma_mm = 1.0; // >= 0 and at most kLargestSigma samples; 0: derivatives are differences
};
constexpr double kLargestSigma = 32; // samples: a thread holds 288^3 floats

Result<BrickMaker> gaussian_bricks(const Volume& volume, const GaussianOptions& options);
Result<Volume> gaussian(const Volume& volume, const GaussianOptions& options, const Task& task);

// The derivative along one axis of the world (0: left, 1: posterior, 2: superior), per mm, or the
// second derivative along two, per mm^2.
struct DerivativeOptions {
    double sigma_mm = 1.0;
    int axis = 0;
    std::optional<int> second_axis;
};
Result<BrickMaker> derivative_bricks(const Volume& volume, const DerivativeOptions& options);
Result<Volume> derivative(const Volume& volume, const DerivativeOptions& options, const Task& task);

// Length of the gradient, per mm.
Result<BrickMaker> gradient_magnitude_bricks(const Volume& volume, const GaussianOptions& options);
Result<Volume> gradient_magnitude(const Volume& volume, const GaussianOptions& options,
                                  const Task& task);

// A vector a voxel: its components along the world's axes (left, posterior, superior), f32, on one
// grid.
using VectorField = std::array<Volume, 3>;
Result<VectorField> gradient(const Volume& volume, const GaussianOptions& options,
                             const Task& task);

} // namespace palpate
