#pragma once

#include <optional>

#include "engine/segment/bit_mask.h"

namespace palpate {

enum class MorphologyStep { erode, dilate, open, close };

struct MorphologyOptions {
    MorphologyStep step = MorphologyStep::erode;
    // A structuring element of neighbours, applied `times` (0: nothing changes) ..
    Neighbours neighbours = Neighbours::faces;
    uint32_t times = 1;
    // .. or a ball about each sample, which holds the samples whose centres are at most this far
    // (to 1e-6 of it), whatever the spacing. > 0. Time grows with the rows of the ball, up to 512
    // of them (13 samples); then it does not depend on it.
    std::optional<double> radius_mm;
    // A label alone; without one all samples that are not 0, as one object.
    std::optional<uint16_t> label;
    bool overwrite = false; // a label grows over others too, not over 0 alone
};

// Erosion keeps the samples whose structuring element lies in the object, dilation adds all samples
// in that of any; opening is an erosion and then a dilation, closing the reverse. Beyond the volume
// samples are neither in the object nor out of it: so nothing erodes at the border, opening and
// closing are idempotent, and each step of the complement is the other step of the object.
//
// Without a label the result is u8, 1 in the object. With one it is the map: a sample that leaves
// the label becomes 0. Refused: values that are no labels, a radius not above 0, label 0, with a
// ball a grid whose axes are not perpendicular. Memory beside the result: 2 bits a sample, with a
// ball of more rows signed_distance()'s too. NaN is 0.
Result<Volume> morphology(const Volume& labels, const MorphologyOptions& options, const Task& task);

} // namespace palpate
