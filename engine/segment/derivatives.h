#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/segment/brick_maker.h"
#include "engine/segment/kernel.h"

namespace palpate {

// The smoothed volume and its derivatives by the index, a brick at a time: the ground of the
// Gaussian filters and of those built on a gradient or a Hessian matrix. Rules: gaussian.h.
class Derivatives {
 public:
    // sigma_mm is not negative and at most kLargestSigma samples on each axis, and values are as
    // check_magnitude() asks; check() says so.
    static Result<void> check(const Volume& volume, double sigma_mm);
    Derivatives(Volume volume, double sigma_mm);

    // For each of `orders` (derivatives along x, y, z; together at most 2) an array of the brick's
    // samples: kBrickSamples floats, of which those beyond the volume hold anything. NaN where the
    // volume has no data. False where the volume is constant nearby: then nothing is written.
    bool compute(glm::uvec3 brick, std::span<const glm::ivec3> orders,
                 std::vector<std::vector<float>>& out) const;

    const Volume& volume() const { return volume_; }

 private:
    Volume volume_;
    std::array<std::array<Kernel, 3>, 3> kernels_; // by axis and order
    glm::ivec3 halo_{};
};

} // namespace palpate
