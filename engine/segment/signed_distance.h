#pragma once

#include <cstdint>
#include <limits>

#include "engine/segment/task.h"

namespace palpate {

enum class DistanceOf {
    mask,   // samples that are not 0, as one object
    label,  // one label
    labels, // every label apart: the boundaries between two labels count too
};

struct SignedDistanceOptions {
    DistanceOf of = DistanceOf::mask;
    uint16_t label = 1; // of DistanceOf::label
    // Samples farther than this get exactly +-max_mm, and less work. > 0.
    double max_mm = std::numeric_limits<double>::infinity();
};

// For every sample the distance in mm to the nearest sample of another kind: from samples of the
// object (of a label) to the nearest one outside it, and the reverse. Negative in the object (in
// labels that are not 0), positive outside. f32, on the grid of the labels.
//
// Distances are between centres of samples. So the surface lies half-way between neighbours that
// differ: those have -h and +h, h their distance, and linear interpolation is 0 in their middle.
// itk::SignedMaurerDistanceMapImageFilter has the same values outside; inside it measures to the
// nearest sample of the object that has a neighbour outside, which is up to a sample less.
//
// Exact: the separable lower envelope of parabolas (Saito & Toriwaki, "New algorithms for Euclidean
// distance transformation", 1994; Meijster et al. 2000; Felzenszwalb & Huttenlocher 2012), in
// squares of the smallest spacing. Where the squares of all spacings are whole multiples of the
// smallest one's (to 1e-6), squared distances are whole numbers, exact in float up to 4096
// samples; else each has two roundings. The runs of one label along a line are independent, so both
// signs and all labels take one pass.
//
// Where there is no sample of another kind (an empty mask, a full one) the distance is no data, or
// +-max_mm where that is finite. NaN in `labels` is 0.
//
// Refused: values outside 0 .. 65535; axes more than 1e-4 off perpendicular (a sheared grid: its
// metric is not separable; below that, lengths are right to 1e-4). Memory: 4 bytes a sample beside
// the result, and a plane and a column of bricks a thread.
Result<Volume> signed_distance(const Volume& labels, const SignedDistanceOptions& options,
                               const Task& task);

// The axes of a grid meet at right angles, to the tolerance above; else a sentence that begins with
// `name`.
Result<void> check_perpendicular(const Grid& grid, const char* name);

} // namespace palpate
