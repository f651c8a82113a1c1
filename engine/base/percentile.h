#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/assert.h"

namespace palpate {

// The smallest of the values that at least this share of them does not exceed (nearest rank).
// One value at least; share 0 .. 1, where 0 gives the least and 1 the largest.
inline double percentile(std::vector<double> values, double share) {
    PALPATE_ASSERT(!values.empty());
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    const auto at = values.begin() + static_cast<ptrdiff_t>(std::max(rank, 1.0)) - 1;
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

} // namespace palpate
