#pragma once

#include "bench/segment/cases.h"

// The exact results of cases at a sample, in double, by brute force; NaN where a case has none
// there.
namespace palpate::bench {

using Exact = double(const SegmentInput& in, glm::ivec3 at);
Exact exact_gaussian, exact_slope, exact_median, exact_bilateral;
Exact exact_distance_outside, exact_distance_of_labels, exact_distance_to_middle;
Exact exact_erosion, exact_erosion_by_ball; // 0 or 1
Exact exact_linear, exact_cubic;            // at a sample of turned_grid()

// The residual of gradient vector flow: root mean square of mu laplace(v) - |g|^2 (v - g) over that
// of |g|^2 g, of the component along x.
double flow_residual(const SegmentInput& in, const Samples& x_of_field);

} // namespace palpate::bench
