#pragma once

#include "bench/suite/environment.h"
#include "bench/suite/subject.h"
#include "engine/image/image.h"

namespace palpate::bench {

// How far a picture is from grid truth, over all its pixels.
//
//   color    differences of R, G and B, linear, 0 .. 1
//   value    differences of the maximum along the ray, HU; rays that miss the volume are left out
//   surface  one figure a ray, in samples (the smallest spacing): how far the first surface is off
//            in depth, at most 1; and 1 where only one picture has a surface. Rays on which neither
//            has one are left out. A picture that knows where it has a surface but not how deep
//            ("hit" instead of "depth") counts as right about the depth.
struct Errors {
    double rmse = 0, max = 0, p999 = 0; // p999: 99.9 % of all differences are not above
    double mean_signed = 0;             // picture minus truth; 0 for `surface`
    double flip_mean = -1;              // of the colours, FLIP; below 0 where there are none
    uint64_t count = 0;                 // differences taken
    std::string unit;                   // "colour", "HU", "samples"

    Json json() const;
};

// Both pictures have one size; truth has R, G, B, value and depth, the picture those its metric
// needs: R, G, B; or value; or depth, or hit (above 0.5 where there is a surface).
Errors errors_of(const Image& picture, const Image& truth, Metric metric, double sample_mm);

// The difference at each pixel, for a map; NaN where none is taken.
std::vector<double> difference_map(const Image& picture, const Image& truth, Metric metric,
                                   double sample_mm);

} // namespace palpate::bench
