#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace palpate {

// A Gaussian or one of its derivatives along one axis, as weights of neighbouring samples.
//
// With w = weights, and f[k] the sample k places on, it gives
//   order 0:  f[0] + sum w[k] (f[k] + f[-k] - 2 f[0])
//   order 1:         sum w[k] (f[k] - f[-k])            value units per sample
//   order 2:         sum w[k] (f[k] + f[-k] - 2 f[0])   value units per sample^2
// so that constants stay as they are to the bit (order 0) or give exactly 0, and flipped samples
// give the flipped result.
//
// The weights are those of the sampled Gaussian, n^0, n^1 or n^2 - b times exp(-n^2 / (2 s^2)), cut
// at kReach sigma. s is chosen such that the moment after the first that counts is that of the
// true kernel of deviation sigma: polynomials up to degree 3 (order 0), 4 (1) and 5 (2) are treated
// exactly, whatever is cut off and however small sigma is. s differs from sigma by less than 1 %
// from 0.6 samples on (order 0). Derivatives of less than sqrt(1/3) (order 1) and sqrt(1/6) samples
// (order 2) cannot reach that moment and are differences of nearest neighbours.
//
// Of an edge of height 1 whose profile is an error function, order 0 errs by less than 1.7e-4 where
// the edge's deviation and sigma are 1.3 samples or more, and by less than 6e-4 where both are 0.8
// (derived and held in the test Kernel.EdgesErr). Samples of a sharp step hold no such profile:
// read as constant round each sample, the exact result differs by that of 1/12 sample^2 more
// variance, at most 0.010 / (sigma in samples)^2.
struct Kernel {
    int order = 0;              // 0, 1 or 2
    std::vector<float> weights; // of distances 1 .. radius; weights[0] is not used

    int radius() const { return int(weights.size()) - 1; }
};

constexpr double kReach = 4.0; // in sigma; beyond it lies 6.3e-5 of a Gaussian's integral

// sigma in samples, >= 0; at 0 order 0 changes nothing.
Kernel gaussian_kernel(double sigma, int order);

} // namespace palpate
