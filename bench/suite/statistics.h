#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

// Statistics of a list of measurements.
namespace palpate::bench {

// The median, and an interval that holds the true one in at least 95 of 100 runs: order statistics,
// whatever the distribution (David & Nagaraja, Order Statistics, 2003, section 7.1). With fewer
// than 6 values the interval is from the smallest to the largest, and holds it less often.
struct Spread {
    double median = 0, p95 = 0;
    double low = 0, high = 0;
    size_t count = 0;

    // Half the interval as a share of the median: what two medians may differ by for no reason.
    double noise() const { return median > 0 ? 0.5 * (high - low) / median : 0.0; }
};
Spread spread(const std::vector<double>& values); // one or more

// y = factor * x^order, fitted to the logarithms by least squares.
struct PowerLaw {
    double order = 0, factor = 0;
    // The true order is within order +- band in 95 of 100 such fits, where the logarithms scatter
    // normally; absent with fewer than 3 points, as two always fit.
    std::optional<double> band;
    size_t points = 0;
};
// x and y: two or more pairs, all above 0, not all of the same x.
PowerLaw fit_power(std::span<const double> x, std::span<const double> y);

// A measured setting: smaller is better both ways.
struct Cost {
    double ms = 0, error = 0;
};

// a is nowhere worse than b and somewhere better.
bool dominates(Cost a, Cost b);
// a is better than b both ways.
bool strictly_below(Cost a, Cost b);

// The settings that no other dominates, in order of time.
std::vector<size_t> pareto_front(std::span<const Cost> costs);

// Another setting that is beyond doubt faster than `one` and no less exact: by time its median
// exceeds what both noises explain together (the root of their squares' sum), and at least 2 %. The
// one with the greatest gain in time, if any.
struct Measured {
    Cost cost;
    double noise = 0; // of the time, as a share
};
std::optional<size_t> beaten_by(std::span<const Measured> settings, size_t one);

} // namespace palpate::bench
