#pragma once

#include <cstdint>
#include <vector>

#include "engine/segment/brick_maker.h"

namespace palpate {

struct SmoothLabelsOptions {
    double sigma_mm = 1.0;          // > 0, at most 8 samples along each axis
    bool keeps_volumes = true;      // else a label's indicator is not lifted
    std::vector<uint16_t> locked{}; // labels that neither lose nor gain a sample
};

// Smooths the walls between all labels and the background at once: each sample gets the label whose
// indicator, smoothed with a Gaussian and lifted, is largest there (of equal ones its own, then the
// lowest). So every sample has one label before and after: no gap, no overlap. The Gaussian is
// sampled and cut at 3 sigma; beyond the volume its outermost samples go on. In the map's own type;
// NaN is 0.
//
// A Gaussian draws walls inward where they are convex. Each label's lift, one number of -0.45 to
// 0.45, gives back what it loses: the number of its samples stays, to 0.1 % or a sample as a rule.
// Lifts come from up to four surveys of all bricks before the first is made. A label that is
// thinner than about sigma loses more, and may vanish; so may one whose walls are all flat and
// along the axes, where whole layers change at once, be off by a part of a layer.
//
// Refused: values that are no labels; sigma out of range. Memory: a brick with its halo for each
// thread, and 8 KiB for two labels that touch. On a sheared grid the Gaussian is along the slanted
// axes.
Result<BrickMaker> smooth_labels_bricks(const Volume& labels, const SmoothLabelsOptions& options,
                                        const Task& task);
Result<Volume> smooth_labels(const Volume& labels, const SmoothLabelsOptions& options,
                             const Task& task);

} // namespace palpate
