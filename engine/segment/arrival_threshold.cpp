#include "engine/segment/arrival_threshold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate {

namespace {

constexpr int kStepsOfTwo = 8;                      // kGrowthRatio^8 = 2
constexpr int kLeastPower = -149, kMostPower = 129; // of positive floats, as frexp() has them
constexpr size_t kBands = size_t{kStepsOfTwo} * (kMostPower - kLeastPower + 1);

double power_of_ratio(int steps) {
    static const std::array<double, kStepsOfTwo> table = [] {
        std::array<double, kStepsOfTwo> powers{};
        for (int i = 0; i < kStepsOfTwo; ++i)
            powers[size_t(i)] = std::exp2(double(i) / kStepsOfTwo);
        return powers;
    }();
    return table[size_t(steps)];
}

// Band b holds the arrivals t with time_of(b) <= t < time_of(b + 1).
size_t band_of(float arrival) {
    int power = 0;
    const double mantissa = 2.0 * std::frexp(double{arrival}, &power); // 1 .. 2
    int step = kStepsOfTwo - 1;
    while (mantissa < power_of_ratio(step))
        --step;
    return size_t(kStepsOfTwo * (power - kLeastPower) + step);
}

double time_of(size_t band) {
    const int steps = int(band);
    return std::ldexp(power_of_ratio(steps % kStepsOfTwo), steps / kStepsOfTwo + kLeastPower - 1);
}

struct Bands {
    std::vector<uint64_t> counts = std::vector<uint64_t>(kBands);
    std::vector<double> costs = std::vector<double>(kBands); // sums
    uint64_t seeds = 0;
};

// One layer of bricks after the other, so that sums do not depend on the number of threads.
Result<Bands> bands_of(const Volume& arrival, const Volume* cost, const Task& task) {
    const glm::uvec3 bricks = arrival.brick_count();
    std::vector<Bands> layers(bricks.z);
    const auto add_brick = [&](glm::uvec3 at, Bands& bands) {
        const Brick& times = arrival.brick(at);
        const Brick::Pinned pinned = times.pin();
        const Brick::Pinned costs = cost ? cost->brick(at).pin() : Brick::Pinned();
        const glm::uvec3 valid = arrival.valid_in_brick(at);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t offset = offset_in_brick({x, y, z});
                    const float time = times.value(pinned, offset);
                    if (std::isnan(time))
                        continue;
                    if (time <= 0.0f) {
                        ++bands.seeds;
                        continue;
                    }
                    const size_t band = band_of(time);
                    ++bands.counts[band];
                    if (cost)
                        bands.costs[band] += cost->brick(at).value(costs, offset);
                }
    };
    const bool all = run_all(bricks.z, task, [&](size_t z) {
        for (uint32_t y = 0; y < bricks.y; ++y)
            for (uint32_t x = 0; x < bricks.x; ++x)
                add_brick({x, y, uint32_t(z)}, layers[z]);
    });
    if (!all)
        return stopped();
    Bands sum;
    for (const Bands& layer : layers) {
        sum.seeds += layer.seeds;
        for (size_t band = 0; band < kBands; ++band) {
            sum.counts[band] += layer.counts[band];
            sum.costs[band] += layer.costs[band];
        }
    }
    return sum;
}

// The first band behind which half as many samples again as the seeds have arrived, and one behind
// the last that is not empty.
std::pair<size_t, size_t> range_of(const Bands& bands) {
    size_t first = kBands, last = 0;
    uint64_t arrived = 0;
    for (size_t band = 0; band < kBands; ++band) {
        arrived += bands.counts[band];
        if (bands.counts[band] > 0)
            last = band + 1;
        if (first == kBands && arrived > 0 && 2 * arrived >= bands.seeds)
            first = band;
    }
    return {std::min(first, last), last};
}

std::vector<double> smoothed(const std::vector<double>& values) {
    std::vector<double> result(values.size());
    for (size_t i = 0; i < values.size(); ++i)
        result[i] = 0.25 * values[i > 0 ? i - 1 : i] + 0.5 * values[i] +
                    0.25 * values[std::min(i + 1, values.size() - 1)];
    return result;
}

} // namespace

Result<ArrivalGrowth> arrival_growth(const Volume& arrival, const Task& task) {
    PALPATE_TRY(const Bands bands, bands_of(arrival, nullptr, task));
    const auto [first, last] = range_of(bands);
    ArrivalGrowth growth;
    double arrived = double(bands.seeds);
    for (size_t band = 0; band < last; ++band) {
        arrived += double(bands.counts[band]);
        if (band >= first) {
            growth.times.push_back(time_of(band + 1));
            growth.counts.push_back(arrived);
        }
    }
    for (size_t i = 0; i + 1 < growth.counts.size(); ++i)
        growth.rates.push_back(std::log(growth.counts[i + 1] / growth.counts[i]) /
                               std::log(kGrowthRatio));
    growth.rates = smoothed(smoothed(growth.rates));
    return growth;
}

std::optional<double> boundary_time(const ArrivalGrowth& growth) {
    size_t fastest = 0;
    std::optional<size_t> slowest;
    for (size_t i = 0; i < growth.rates.size(); ++i) {
        const double rate = growth.rates[i];
        if (!slowest) {
            if (rate >= growth.rates[fastest])
                fastest = i;
            if (rate < (1.0 - kTurn) * growth.rates[fastest] &&
                growth.counts[i] > kGrown * growth.counts[fastest])
                slowest = i;
        } else if (rate < growth.rates[*slowest]) {
            slowest = i;
        } else if (rate > (1.0 + kTurn) * growth.rates[*slowest]) {
            return growth.times[*slowest];
        }
    }
    return std::nullopt;
}

Result<std::optional<double>> band_cost_time(const Volume& arrival, const Volume& cost,
                                             double factor, const Task& task) {
    if (arrival.grid() != cost.grid())
        return fail("expected a cost on the grid of the arrival, found another grid");
    PALPATE_TRY(const Bands bands, bands_of(arrival, &cost, task));
    const auto [first, last] = range_of(bands);
    const auto mean = [&](size_t band) { return bands.costs[band] / double(bands.counts[band]); };
    for (size_t band = first + 1; band < last; ++band)
        if (bands.counts[band] > 0 && bands.counts[first] > 0 && mean(band) > factor * mean(first))
            return std::optional(time_of(band));
    return std::optional<double>();
}

} // namespace palpate
