#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/segment/task.h"

namespace palpate {

struct BetweenSlicesOptions {
    // Across which the slices were drawn: 0 x, 1 y, 2 z. Without one each label's own
    // (axis_with_gaps()).
    std::optional<int> axis;
    std::optional<uint16_t> label;      // without one each label
    std::span<const uint16_t> locked{}; // labels that get no sample
};

// Fills the slices between those drawn by hand, by the distances within them (Raya & Udupa,
// "Shape-based interpolation of multidimensional objects", 1990), piece by piece.
//
// Label by label, between two slices a < b that carry it with none between them: pieces (joined by
// edges and corners in the slice) that lie over each other belong together, so that one may become
// two; of those left over, the nearest two, one in each slice, belong together where their
// centroids are no farther apart than the sum of the diameters of discs of their areas. Pieces that
// belong together move in a straight line by the way v from the centroid of those in a to that of
// those in b (to 1/64 of a sample): at a share t between the slices the label is where
//     (1 - t) d_a(p - t v) + t d_b(p + (1 - t) v) < 0,
// d_a and d_b the signed distances in mm to them in both slices (signed_distance(), linear between
// samples, beyond the border its nearest value). A piece that belongs to none shrinks against the
// whole label of the other slice, without a move.
//
// Among several labels the lowest blend takes a sample, then the lowest label. Only samples
// that are 0 take any, so what was drawn stays, and slices that carry a label stay as they are for
// it. A label in one slice alone stays as it is: nothing is made beyond the first and the last.
// Labels across x take samples before those across y, those before the ones across z. In the map's
// own type; NaN is 0.
//
// Refused: values that are no labels, an axis that is none, slices that are sheared. Memory: 6
// bytes a sample of the slices between, and for each thread 20 of two pieces' boxes.
Result<Volume> interpolate_slices(const Volume& labels, const BetweenSlicesOptions& options,
                                  const Task& task);

// The axis across which a label was drawn in slices with others between them: the one with most
// layers that lack the label between its first and its last; of equal ones the last. -1: none.
int axis_with_gaps(const Volume& labels, uint16_t label);

} // namespace palpate
