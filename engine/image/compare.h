#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/image/flip.h"
#include "engine/image/image.h"

namespace palpate {

// How far the second image is from the first, in the samples' own units.
//
// Two samples are the same when both are equal numbers, both are NaN, or both are the same
// infinity. Where just one is finite, or they are otherwise unlike, no difference can be measured:
// such samples are counted in `nan_mismatch`, are beyond any bound, and stay out of max_abs, rmse
// and mean_signed, which are 0 where nothing could be measured.
struct SampleDifference {
    std::string channel; // a channel's name; "RGB" where R, G and B are taken together
    double max_abs = 0.0;
    double rmse = 0.0;
    double mean_signed = 0.0; // second minus first
    double share_beyond =
        0.0;             // 0 .. 1: of pixels with a sample that differs by more than the bound
    uint64_t beyond = 0; // the same, counted
    uint64_t nan_mismatch = 0; // samples
};

struct ImageDifference {
    std::vector<SampleDifference> channels; // in the order of the first image
    SampleDifference all;                   // over every channel together
    std::optional<SampleDifference> rgb;    // where both images have R, G and B
    // 0 .. 1: of pixels for which some pixel of the other image within the 3x3 window around it
    // differs by at most the bound in every channel, looked for both ways round. Forgives edges
    // that move by a pixel and nothing else (after the image comparison of dEQP).
    double neighborhood_match_share = 0.0;
    std::optional<double> flip_mean; // flip.h; where both images have colours
};

// Compares two images of one size with the same channels, in whatever order; an error where they
// are not, or where the bound is below 0.
// bound >= 0, in the samples' units: differences up to it, itself included, are within.
Result<ImageDifference> compare_images(const Image& first, const Image& second, double bound,
                                       double pixels_per_degree = kFlipPixelsPerDegree);

// The root mean square of the differences in R, G and B alone. Images of one size whose first three
// channels these are, as the renderers give them.
double color_rmse(const Image& first, const Image& second);

// |second - first| of every sample, times `gain`, with the alpha channel set to 1; samples that
// cannot be measured become 1. Same size and channels as `first`.
Image difference_image(const Image& first, const Image& second, float gain);

} // namespace palpate
