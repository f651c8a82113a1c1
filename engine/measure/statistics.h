#pragma once

#include <cstdint>
#include <vector>

namespace palpate {

// Statistics of the values of some samples. Those of no sample are NaN, never 0.
struct ValueStatistics {
    uint64_t count = 0;   // of samples with data: what all others are about
    uint64_t no_data = 0; // of samples without
    double mean, sd;      // sd: with count - 1; NaN for one sample
    double min, p5, p25, median, p75, p95, max;
};

// A percentile is the smallest value that at least this share of the values does not exceed
// (nearest rank), so it is one of them. Sums are made in rising order, in double: the result does
// not depend on the order of the values. NaN is no data.
ValueStatistics statistics_of(std::vector<float> values);

} // namespace palpate
