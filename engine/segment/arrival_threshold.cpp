#include "engine/segment/arrival_threshold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "engine/volume/box.h"
#include "engine/volume/grid.h"

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

// Sums over the faces of a front, of the quantities across it. Index 0: the seeds alone; b + 1: all
// samples up to band b.
struct Fronts {
    std::vector<double> counts, faces, area_mm2, contrast, rise, step;
    Fronts() {
        for (std::vector<double>* sums : {&counts, &faces, &area_mm2, &contrast, &rise, &step})
            sums->resize(kBands + 2);
    }
};
constexpr size_t kUnreached = kBands + 1;

// Adds what the pairs of neighbours in a brick, and from it to the next, change in the sums where
// the front comes to lie between them, and where it has passed both.
void add_pairs(const Volume& arrival, const Volume& cost, const Volume& values, glm::uvec3 at,
               Fronts& fronts) {
    constexpr int kWide = int(kBrickSide) + 1;
    constexpr size_t kCount = size_t{kWide} * kWide * kWide;
    thread_local std::vector<float> times(kCount), costs(kCount), greys(kCount);
    thread_local std::vector<uint16_t> entry(kCount);
    const glm::ivec3 first(at * kBrickSide), valid(arrival.valid_in_brick(at));
    const glm::ivec3 wide = glm::min(glm::ivec3(kWide), glm::ivec3(arrival.size()) - first);
    const BoxStrides strides{kWide, size_t{kWide} * kWide};
    read_box(arrival, first, wide, strides, times.data());
    read_box(cost, first, wide, strides, costs.data());
    read_box(values, first, wide, strides, greys.data());
    const glm::dvec3 h = spacing_mm(arrival.grid());
    const size_t step[] = {1, strides.row, strides.plane};
    const auto number = [&](int x, int y, int z) {
        return size_t(x) + strides.row * size_t(y) + strides.plane * size_t(z);
    };
    for (int z = 0; z < wide.z; ++z)
        for (int y = 0; y < wide.y; ++y)
            for (int x = 0; x < wide.x; ++x) {
                const size_t i = number(x, y, z);
                entry[i] = std::isnan(times[i]) ? uint16_t(kUnreached)
                           : times[i] <= 0.0f   ? uint16_t{0}
                                                : uint16_t(band_of(times[i]) + 1);
            }
    for (int z = 0; z < valid.z; ++z)
        for (int y = 0; y < valid.y; ++y)
            for (int x = 0; x < valid.x; ++x) {
                const glm::ivec3 p(x, y, z);
                const size_t i = number(x, y, z);
                ++fronts.counts[entry[i]];
                for (int k = 0; k < 3; ++k) {
                    const size_t j = i + step[k];
                    if (p[k] + 1 >= wide[k] || entry[i] == entry[j])
                        continue;
                    const size_t in = entry[i] < entry[j] ? i : j, out = in == i ? j : i;
                    const double beyond = double{costs[out]}, within = double{costs[in]};
                    const double contrast = std::log(beyond / within);
                    const double difference = std::abs(double{greys[out]} - double{greys[in]});
                    if (!std::isfinite(contrast) || !std::isfinite(difference))
                        continue; // a wall bounds all fronts
                    const double area = h[(k + 1) % 3] * h[(k + 2) % 3];
                    const auto add = [&](std::vector<double>& sums, double value) {
                        sums[entry[in]] += value;
                        sums[entry[out]] -= value;
                    };
                    add(fronts.faces, 1.0);
                    add(fronts.area_mm2, area);
                    add(fronts.contrast, area * contrast);
                    add(fronts.rise, area * std::log((1.0 + beyond) / (1.0 + within)));
                    add(fronts.step, area * difference);
                }
            }
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
    return growth;
}

Result<std::optional<double>> boundary_time(const Volume& arrival, const Volume& cost,
                                            const Volume& values, const Task& task) {
    for (const Volume* other : {&cost, &values})
        if (arrival.size() != other->size())
            return fail("expected cost and values on the grid of the arrival, found another grid");
    const glm::uvec3 bricks = arrival.brick_count();
    std::vector<Fronts> layers(bricks.z);
    const bool all = run_all(bricks.z, task, [&](size_t z) {
        for (uint32_t y = 0; y < bricks.y; ++y)
            for (uint32_t x = 0; x < bricks.x; ++x)
                add_pairs(arrival, cost, values, {x, y, uint32_t(z)}, layers[z]);
    });
    if (!all)
        return stopped();
    // Changes of all layers, in order, and of all times up to each.
    Fronts sum;
    const auto sums_of = [](Fronts& of) {
        return std::array{&of.counts, &of.faces, &of.area_mm2, &of.contrast, &of.rise, &of.step};
    };
    for (size_t i = 0; i < sums_of(sum).size(); ++i) {
        std::vector<double>& to = *sums_of(sum)[i];
        for (Fronts& layer : layers)
            for (size_t b = 0; b < to.size(); ++b)
                to[b] += (*sums_of(layer)[i])[b];
        for (size_t b = 1; b < to.size(); ++b)
            to[b] += to[b - 1];
    }
    const auto has_front = [&](size_t b) { return sum.faces[b] > 0.5; };
    const auto contrast = [&](size_t b) {
        const double face_mm2 = sum.area_mm2[b] / sum.faces[b];
        return sum.contrast[b] / (sum.area_mm2[b] + kNoContrast * face_mm2);
    };
    std::optional<size_t> clearest;
    for (size_t b = 0; b < kUnreached; ++b)
        if (has_front(b) && contrast(b) >= 1.0 && (!clearest || contrast(b) > contrast(*clearest)))
            clearest = b;
    if (!clearest)
        return std::optional<double>();
    // The time of the largest mean, among those by which the front has gained so many layers, and
    // all before which it has grown evenly.
    size_t best = *clearest;
    const auto is_even = [&](size_t b) {
        const double grown = sum.counts[b] / sum.counts[*clearest];
        return sum.area_mm2[b] <= kEven * sum.area_mm2[*clearest] * std::pow(grown, 2.0 / 3.0);
    };
    const auto go_on = [&](const std::vector<double>& sums, double more) {
        const double most = sum.counts[best] + more * sum.faces[best];
        const auto mean = [&](size_t b) { return sums[b] / sum.area_mm2[b]; };
        for (size_t b = best + 1; b < kUnreached && sum.counts[b] <= most && is_even(b); ++b)
            if (has_front(b) && mean(b) > mean(best) * (1.0 + 1e-9))
                best = b;
    };
    go_on(sum.rise, kEdgeLayers);
    go_on(sum.step, 1.0);
    // The next band begins at its time; arrivals are floats.
    return std::optional(best == 0 ? 0.0 : std::nextafter(time_of(best), 0.0));
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
