#pragma once

#include <cstdint>
#include <vector>

#include "engine/segment/brick_maker.h"

namespace palpate {

struct LabelMedianOptions {
    double radius_mm = 1.0; // > 0, at most 8 samples along each axis
    // Labels that neither lose nor gain a sample, and do not count.
    std::vector<uint16_t> locked{};
};

// Gives each sample the label that most samples of the ball about it carry, the background among
// them; of equally frequent ones its own, then the lowest. For two labels that is the median, which
// takes away what is thinner than half the ball and keeps straight walls. Every sample has one
// label before and after. The ball holds the samples whose centres are at most radius_mm away (to
// 1e-6 of it); beyond the volume its outermost samples go on. In the map's own type; NaN is 0.
//
// Refused: values that are no labels, a radius out of range. Memory: a brick with its halo for each
// thread. On a sheared grid the ball is along the slanted axes.
Result<BrickMaker> label_median_bricks(const Volume& labels, const LabelMedianOptions& options);

} // namespace palpate
