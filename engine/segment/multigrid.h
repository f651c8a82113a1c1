#pragma once

#include <array>
#include <vector>

#include "engine/segment/brick_array.h"

namespace palpate {

// Solves  weight u - mu laplace(u) = right  on a grid of samples, with no flow through the border:
// u is `right / weight` where weight is large, and smooth where it is 0. By multigrid, in bricks,
// whose cycles converge slower where a size is odd on some level (its last coarse sample stands for
// half a cell); every operation of a brick reads what the pass before left, so threads change no
// bit.
class Multigrid {
 public:
    // weight >= 0, and above 0 somewhere. spacing_mm: of perpendicular axes. The arrays hold every
    // brick. `u` starts as the first guess. `packed`: keeps the weights as packed_floats.h does, in
    // half of the memory, and rounds them so.
    Multigrid(glm::dvec3 spacing_mm, double mu, BrickArray<float> u, BrickArray<float> weight,
              BrickArray<float> right, bool packed = false);

    void cycle();                                                // one V-cycle
    double residual() const;                                     // root of the sum of squares
    BrickArray<float> take() { return std::move(levels_[0].u); } // ends its use

 private:
    struct Level {
        glm::uvec3 size;
        glm::dvec3 spacing_mm;
        glm::uvec3 coarsened; // by 2 or 1 from the level before
        BrickArray<float> u, weight, right;
        BrickArray<uint16_t> packed_weight; // of bricks that `weight` lacks
        std::array<float, 3> over_square{}; // mu / spacing^2; 0 along axes of one sample
    };

    void solve(size_t level);
    void relax(Level& level, int sweeps);
    void restrict_to(const Level& fine, Level& coarse) const;
    void correct(Level& fine, const Level& coarse) const;
    void set_factors(Level& level) const;
    static void pack_weights(Level& level);
    static const float* weights(const Level& level, glm::uvec3 brick);

    double mu_;
    std::vector<Level> levels_;
};

} // namespace palpate
