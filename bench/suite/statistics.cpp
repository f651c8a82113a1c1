#include "bench/suite/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/base/percentile.h"

namespace palpate::bench {

Spread spread(const std::vector<double>& values) {
    PALPATE_ASSERT(!values.empty());
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const size_t n = sorted.size();
    // The largest `skip` for which at most skip - 1 of n fair coins show heads in 2.5 % of cases.
    size_t skip = 0;
    double chance = std::pow(0.5, static_cast<double>(n)), below = chance;
    while (below <= 0.025 && skip < n / 2) {
        ++skip;
        chance *= static_cast<double>(n - skip + 1) / static_cast<double>(skip);
        below += chance;
    }
    const size_t first = skip == 0 ? 0 : skip - 1;
    const double median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
    return {median, percentile(values, 0.95), sorted[first], sorted[n - 1 - first], n};
}

PowerLaw fit_power(std::span<const double> x, std::span<const double> y) {
    PALPATE_ASSERT_CMP(x.size(), ==, y.size());
    PALPATE_ASSERT_CMP(x.size(), >=, size_t{2});
    const auto n = static_cast<double>(x.size());
    double mean_x = 0, mean_y = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        PALPATE_ASSERT(x[i] > 0 && y[i] > 0);
        mean_x += std::log(x[i]) / n;
        mean_y += std::log(y[i]) / n;
    }
    double xx = 0, xy = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        const double dx = std::log(x[i]) - mean_x;
        xx += dx * dx;
        xy += dx * (std::log(y[i]) - mean_y);
    }
    PALPATE_ASSERT(xx > 0);
    PowerLaw law{xy / xx, std::exp(mean_y - xy / xx * mean_x), std::nullopt, x.size()};
    if (x.size() < 3)
        return law;
    double residual = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        const double off = std::log(y[i]) - mean_y - law.order * (std::log(x[i]) - mean_x);
        residual += off * off;
    }
    // Student's t at 97.5 % for 1, 2, ... degrees of freedom.
    constexpr std::array<double, 10> kStudent{12.706, 4.303, 3.182, 2.776, 2.571,
                                              2.447,  2.365, 2.306, 2.262, 2.228};
    const double t = kStudent[std::min(x.size() - 2, kStudent.size()) - 1];
    law.band = t * std::sqrt(residual / (n - 2.0) / xx);
    return law;
}

bool dominates(Cost a, Cost b) {
    return a.ms <= b.ms && a.error <= b.error && (a.ms < b.ms || a.error < b.error);
}

bool strictly_below(Cost a, Cost b) {
    return a.ms < b.ms && a.error < b.error;
}

std::vector<size_t> pareto_front(std::span<const Cost> costs) {
    std::vector<size_t> front;
    for (size_t i = 0; i < costs.size(); ++i)
        if (std::none_of(costs.begin(), costs.end(),
                         [&](const Cost& other) { return dominates(other, costs[i]); }))
            front.push_back(i);
    std::sort(front.begin(), front.end(),
              [&](size_t a, size_t b) { return costs[a].ms < costs[b].ms; });
    return front;
}

std::optional<size_t> beaten_by(std::span<const Measured> settings, size_t one) {
    constexpr double kLeast = 0.02;
    const Measured& mine = settings[one];
    std::optional<size_t> best;
    for (size_t i = 0; i < settings.size(); ++i) {
        const Measured& other = settings[i];
        if (i == one || other.cost.error > mine.cost.error)
            continue;
        const double noise = std::max(kLeast, std::hypot(other.noise, mine.noise));
        if (other.cost.ms * (1.0 + noise) < mine.cost.ms &&
            (!best || other.cost.ms < settings[*best].cost.ms))
            best = i;
    }
    return best;
}

} // namespace palpate::bench
