#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/segment/brick_array.h"
#include "engine/segment/packed_floats.h"

namespace palpate {

// Solves  weight u - mu laplace(u) = right  on a grid of samples, with no flow through the border:
// u is `right / weight` where weight is large, and smooth where it is 0. By multigrid, in bricks,
// whose cycles converge slower where a size is odd on some level (its last coarse sample stands for
// half a cell); every operation of a brick reads what the pass before left, so threads change no
// bit.
class Multigrid {
 public:
    // weight >= 0, and above 0 somewhere. spacing_mm: of perpendicular axes. Arrays hold every
    // brick, here and below. `packed`: keeps the weights so, in half of the memory.
    Multigrid(glm::dvec3 spacing_mm, double mu, BrickArray<float> weight,
              std::optional<PackedWeights> packed = {});

    BrickArray<float> weighted(const BrickArray<float>& values) const; // weight values
    void start(BrickArray<float> u, BrickArray<float> right);          // u: the first guess
    void smooth();                                               // a relaxation of the finest grid
    void cycle();                                                // one V-cycle
    double residual() const;                                     // root of the sum of squares
    BrickArray<float> take() { return std::move(levels_[0].u); } // start() comes next

 private:
    struct Level {
        glm::uvec3 size;
        glm::dvec3 spacing_mm;
        glm::uvec3 coarsened; // by 2 or 1 from the level before
        BrickArray<float> u, weight, right;
        BrickArray<uint16_t> packed_weight; // of bricks that `weight` lacks
        std::array<float, 3> over_square{}; // mu / spacing^2; 0 along axes of one sample
    };

    void coarsen(); // makes the coarse levels, which a relaxation alone does not need
    void solve(size_t level);
    void relax(Level& level, int sweeps);
    void restrict_to(const Level& fine, Level& coarse) const;
    void correct(Level& fine, const Level& coarse) const;
    void set_factors(Level& level) const;
    void pack_weights(Level& level) const;
    const float* weights(const Level& level, glm::uvec3 brick) const;

    double mu_;
    std::optional<PackedWeights> packed_;
    std::vector<Level> levels_;
};

} // namespace palpate
