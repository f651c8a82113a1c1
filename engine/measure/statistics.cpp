#include "engine/measure/statistics.h"

#include <algorithm>
#include <cmath>

namespace palpate {

ValueStatistics statistics_of(std::vector<float> values) {
    const size_t all = values.size();
    std::erase_if(values, [](float v) { return std::isnan(v); });
    ValueStatistics out{};
    out.count = values.size();
    out.no_data = all - values.size();
    out.mean = out.sd = out.min = out.p5 = out.p25 = out.median = out.p75 = out.p95 = out.max = NAN;
    if (values.empty())
        return out;
    std::sort(values.begin(), values.end());
    const auto count = static_cast<double>(values.size());
    double sum = 0.0;
    for (const float v : values)
        sum += double{v};
    out.mean = sum / count;
    double squares = 0.0;
    for (const float v : values)
        squares += (double{v} - out.mean) * (double{v} - out.mean);
    if (values.size() > 1)
        out.sd = std::sqrt(squares / (count - 1.0));
    const auto percentile = [&](double share) {
        const auto rank = static_cast<size_t>(std::max(std::ceil(share * count), 1.0));
        return double{values[rank - 1]};
    };
    out.min = double{values.front()};
    out.p5 = percentile(0.05);
    out.p25 = percentile(0.25);
    out.median = percentile(0.5);
    out.p75 = percentile(0.75);
    out.p95 = percentile(0.95);
    out.max = double{values.back()};
    return out;
}

} // namespace palpate
