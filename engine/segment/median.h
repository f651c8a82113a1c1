#pragma once

#include "engine/segment/brick_maker.h"

namespace palpate {

// The median of the samples of a box round each sample, in the type of the input. Beyond the volume
// its outermost samples count again. Samples without data do not count, and stay without data; of
// an even number of samples the lower of the two in the middle is taken, so that every result is
// one of the samples.
//
// Boxes of 3, 9 and 27 samples are sorted by networks for many samples at once; larger ones by a
// histogram of ranks that slides along x (Huang, Yang and Tang 1979). Memory: a brick and its halo
// for each thread.
struct MedianOptions {
    glm::ivec3 radius_samples{1}; // to each side: 0 .. kLargestMedian
};
constexpr int kLargestMedian = 16;

// Half the side of the box whose samples lie at most radius_mm away along each axis, and at least
// one: the nearest neighbours count where they are farther.
Result<MedianOptions> median_of_mm(const Grid& grid, double radius_mm);

Result<BrickMaker> median_bricks(const Volume& volume, const MedianOptions& options);
Result<Volume> median(const Volume& volume, const MedianOptions& options, const Task& task);

} // namespace palpate
