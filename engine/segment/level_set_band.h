#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "engine/segment/brick_array.h"
#include "engine/segment/simplex_distance.h"

namespace palpate {

// The sparse field of a level set: signed distances in mm (negative inside) of the samples around a
// surface, and which side of it every sample is on.
//
// Layer 0, the active one, holds the samples with a face neighbour on the other side; so the
// surface crosses an edge of each. Layer k holds those that are k steps over faces from it.
// (Whitaker 1998 takes as active what lies within half a sample of the surface, which on uneven
// spacing has no meaning.) The active layer is what moves. Whitaker makes the others anew from it
// after each move, a step of distance for a layer; then second differences have an error as large
// as curvature is. Here they are made anew from all neighbours towards the surface by
// simplex_distance.h, corrected to third order as upwind_bend() says; those that have not been made
// anew yet count as if they had moved as the surface does where the straight way from the sample
// meets it (extension velocities: Adalsteinsson & Sethian 1999). A sample that comes into a layer
// begins with a distance of first order.
//
// Walls are samples that belong to neither side and have no distance. Everything runs by bricks on
// all threads and in passes, each of which reads what the one before has left: the number of
// threads changes no bit. Memory: 0.25 bytes a sample, and 8.5 in bricks near the surface.
class LevelSetBand {
 public:
    static constexpr int kLayers = 4;
    static constexpr uint32_t kRows = kBrickSide * kBrickSide;
    // One bit for each sample of a brick: bit x of row y + 32 z.
    using Bits = std::array<uint32_t, kRows>;

    explicit LevelSetBand(const Grid& grid);

    glm::uvec3 brick_count() const { return phi_.brick_count(); }
    size_t brick_total() const { return bricks_.size(); }
    glm::uvec3 position_of(size_t brick) const;

    // To begin, fill these bits for every brick; then begin(). Samples beyond the grid are walls
    // already.
    Bits& inside(size_t brick) { return bricks_[brick].inside; }
    const Bits& inside(size_t brick) const { return bricks_[brick].inside; }
    Bits& walls(size_t brick) { return bricks_[brick].walls; }

    // Finds the layers. The distance of an active sample is distance(its index), or where that is
    // empty the one of a plane midway between it and its neighbours on the other side.
    void begin(const std::function<float(glm::uvec3 index)>& distance);

    // The bricks with samples in a layer, ascending.
    const std::vector<size_t>& near_bricks() const { return near_; }
    const Bits& active(size_t brick) const { return (*bricks_[brick].layers)[0]; }
    bool is_empty() const { return active_count() == 0; }
    size_t active_count() const;

    // Adds changes[i][k] to the k-th active sample (in the order of the bits) of near_bricks()[i],
    // and brings sides, layers and distances up to date. No change may be above most_step_mm(): so
    // no sample beyond the active layer changes its side. Returns the sum of the squares of what
    // they changed by: a sample cannot be farther from the surface than its neighbour on the other
    // side, and a change ends there.
    double move(const std::vector<std::vector<float>>& changes);
    double most_step_mm() const { return most_step_mm_; }

    // Finds distances that are not known yet. Those of layers 0 to 2 always are.
    void complete();

    // The distance in mm of a sample of a layer; beyond the layers and on walls +-limit_mm(). All
    // samples that are not in a layer are at least that far from the surface.
    float distance(size_t brick, uint32_t offset) const;
    float limit_mm() const { return limit_mm_; }

 private:
    struct BandBrick {
        Bits inside{}, walls{};
        std::unique_ptr<std::array<Bits, kLayers>> layers; // null where all are empty
        std::vector<glm::vec2> solved;                     // distances and changes of a pass
    };
    friend class LevelSetTile;
    // A brick and those that share a face with it, null beyond the grid: itself, then low and high
    // x, y, z.
    using Beside = std::array<const BandBrick*, 7>;

    const BandBrick* find(glm::ivec3 position) const;
    Beside beside(size_t brick) const;
    static uint32_t row_of(const BandBrick& brick, uint32_t row, int layers); // walls left out
    template <class Row>
    static std::array<uint32_t, 3> around(const Beside& bricks, uint32_t row, const Row& bits_of);
    static std::array<uint32_t, 3> across(const Beside& bricks, uint32_t row);
    static Bits layer_bits(const BandBrick& brick, int layer); // walls left out
    void find_layers(const std::vector<size_t>& candidates);
    void solve_layers();
    void start_layers(const std::function<float(glm::uvec3 index)>& distance);

    Grid grid_;
    SimplexDistance metric_;
    double most_step_mm_;
    float limit_mm_;
    BrickArray<float> phi_;    // NaN: not known yet
    BrickArray<float> change_; // of the last move
    std::vector<BandBrick> bricks_;
    std::vector<size_t> near_;
};

// Distances of a brick and of two samples around it, for stencils.
class LevelSetTile {
 public:
    static constexpr int kMargin = 2, kSide = int(kBrickSide) + 2 * kMargin, kPlane = kSide * kSide;
    static constexpr std::array<int, 3> kStrides{1, kSide, kPlane};

    // What stencils round the samples `at` read: two samples along each axis, and one along two.
    // NaN: a wall, or in none of the first `layers` layers; the rest may be anything.
    // Of their last changes where `changes`.
    void load(const LevelSetBand& band, size_t brick, const LevelSetBand::Bits& at, int layers,
              bool changes = false);

    // The distance of sample x of row y + 32 z.
    const float* sample(uint32_t row, int x) const {
        return &values_[size_t(x + kMargin + kSide * (int(row % kBrickSide) + kMargin) +
                               kPlane * (int(row / kBrickSide) + kMargin))];
    }

 private:
    std::vector<float> values_ = std::vector<float>(size_t{kSide} * kPlane);
};

// The second difference to correct a one-sided first one by half of, on an axis of spacing h: from
// that at the sample itself and at its neighbour on that side, NaN where there is none. So weighted
// the difference is of third order where distances are smooth, and takes the smoother side at a
// ridge (WENO3: Jiang & Peng, Weighted ENO schemes for Hamilton-Jacobi equations, 2000).
inline float upwind_bend(float own, float beside, float h) {
    if (std::isnan(own) || std::isnan(beside))
        return std::isnan(own) ? (std::isnan(beside) ? 0.0f : beside) : own;
    const float small = 1e-6f * h * h;
    const float rough_own = own * own + small, rough_beside = beside * beside + small;
    // 1 / (1 + 2 (rough_beside / rough_own)^2)
    const float share =
        rough_own * rough_own / (rough_own * rough_own + 2.0f * rough_beside * rough_beside);
    return own + share * (beside - own);
}

// Calls visit(row, x) for every set bit, in order.
template <class Visit>
void for_each_bit(const LevelSetBand::Bits& bits, const Visit& visit) {
    for (uint32_t row = 0; row < LevelSetBand::kRows; ++row)
        for (uint32_t left = bits[row]; left != 0; left &= left - 1)
            visit(row, std::countr_zero(left));
}

} // namespace palpate
