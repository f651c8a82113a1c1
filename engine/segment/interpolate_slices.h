#pragma once

#include "engine/segment/task.h"

namespace palpate {

// Fills the slices between those drawn by hand (Raya & Udupa, "Shape-based interpolation of
// multidimensional objects", 1990).
//
// Label by label: between two slices across `axis` (0 x, 1 y, 2 z) that carry a label, with none
// between them that does, the signed distances within both slices (mm, signed_distance()) are
// blended linearly, and the label is where the blend is negative. Of several labels the one with
// the lowest blend takes a sample, of equal ones the lowest; only samples that are 0 take any, so
// what was drawn stays. A label in one slice alone stays as it is: nothing is made beyond the first
// and the last. In the map's own type; NaN is 0.
//
// Refused: values that are no labels, an axis that is none, slices that are sheared. Memory: 6
// bytes a sample of the slices between, and 12 of one slice.
Result<Volume> interpolate_slices(const Volume& labels, int axis, const Task& task);

} // namespace palpate
