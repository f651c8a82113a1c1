#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "engine/segment/brick_array.h"
#include "engine/segment/level_set_bits.h"
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
// threads changes no bit. Distances are computed for eight samples along x at once; layers are
// found anew in bricks with samples that changed their side, and in those beside them. Memory: 0.25
// bytes a sample, and 8.5 in bricks near the surface; 0.75 while it begins.
class LevelSetBand {
 public:
    static constexpr int kLayers = 4;
    using Bits = BrickBits;

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
    // The active samples of such a brick.
    const Bits& active(size_t brick) const { return (*bricks_[brick].within)[0]; }
    size_t active_count() const;

    // Adds step * rates[i][k] to the k-th active sample (in the order of the bits) of
    // near_bricks()[i], and brings sides, layers and distances up to date. No change may be above
    // most_step_mm(): so no sample beyond the active layer changes its side. Returns the sum of the
    // squares of what they changed by: a sample cannot be farther from the surface than its
    // neighbour on the other side, and a change ends there.
    double move(const std::vector<std::vector<float>>& rates, double step);
    double most_step_mm() const { return most_step_mm_; }

    // Finds distances that are not known yet. Those of layers 0 to 2 always are.
    void complete();

    // The distance in mm of a sample of a layer; beyond the layers and on walls +-limit_mm(). All
    // samples that are not in a layer are at least that far from the surface.
    float distance(size_t brick, uint32_t offset) const;
    float limit_mm() const { return limit_mm_; }

    // The distances in mm of the samples of layers; NaN elsewhere.
    const BrickArray<float>& distances() const { return phi_; }
    // The changes of the samples of layers in the last move.
    const BrickArray<float>& changes() const { return change_; }

 private:
    struct BandBrick {
        Bits inside{}, walls{};
        // The samples of layers 0 to k, for every k; null where there are none.
        std::unique_ptr<std::array<Bits, kLayers>> within;
        std::vector<glm::vec2> solved; // distances and changes of a pass
    };

    Bits layer(const BandBrick& brick, int k) const;
    template <class Row>
    BitTile tile(size_t brick, const Row& row_of) const;
    template <class Visit>
    void for_active_rows(size_t brick, const Visit& visit) const;
    std::vector<size_t> around(const std::vector<uint8_t>& bricks) const;
    void find_layers(const std::vector<size_t>& candidates);
    void solve_layers();
    void start_layers(const std::function<float(glm::uvec3 index)>& distance);

    Grid grid_;
    SimplexDistance metric_;
    double most_step_mm_;
    float limit_mm_;
    BrickArray<float> phi_;    // NaN on samples of no layer, and on those not known yet
    BrickArray<float> change_; // of the last move; on samples of layers: NaN before they are solved
    std::vector<BandBrick> bricks_;
    std::vector<size_t> near_;
};

} // namespace palpate
