#pragma once

#include "engine/segment/brick_maker.h"

namespace palpate {

struct SmoothLabelsOptions {
    double sigma_mm = 1.0; // > 0, at most 8 samples along each axis
};

// Smooths the walls between all labels and the background at once: each sample gets the label whose
// indicator, smoothed with a Gaussian, is largest there (of equal ones its own, then the lowest).
// So every sample has one label before and after: no gap, no overlap. What is thinner than about
// sigma may vanish. The Gaussian is sampled and cut at 3 sigma; beyond the volume its outermost
// samples go on. In the map's own type; NaN is 0.
//
// Refused: values that are no labels; sigma out of range. Memory: a brick with its halo for each
// thread. On a sheared grid the Gaussian is along the slanted axes.
Result<BrickMaker> smooth_labels_bricks(const Volume& labels, const SmoothLabelsOptions& options);
Result<Volume> smooth_labels(const Volume& labels, const SmoothLabelsOptions& options,
                             const Task& task);

} // namespace palpate
