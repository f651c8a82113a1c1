#include "engine/segment/march_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/segment/edges.h"
#include "engine/segment/map_values.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

float cost_of(double exponent) {
    return float(std::min(kLargestCost, std::exp(std::min(exponent, 20.0))));
}

} // namespace

Result<Volume> edge_cost(const Volume& volume, double edge, const Task& task) {
    PALPATE_TRY(const Volume edges, edge_strength(volume, task.part(0.0, 0.6)));
    return map_values<float>(std::array{&edges}, task.part(0.6, 1.0), [&](std::array<float, 1> g) {
        return std::isnan(g[0]) ? g[0] : cost_of(double(g[0]) / edge);
    });
}

Result<double> edge_under_seeds(const Volume& volume, const Volume& seeds, uint16_t label,
                                const Task& task) {
    PALPATE_TRY(const Volume edges, edge_strength(volume, task));
    for (const SeedValues& values : seed_values(edges, seeds))
        if (values.label == label && values.mean > 0.0)
            return values.mean;
    return 1.0;
}

namespace {

// (1 2 1) / 4 along each axis; neighbours beyond the volume or without data are left out.
BrickPtr smoothed_brick(const Volume& volume, glm::uvec3 position) {
    constexpr int kPadded = int(kBrickSide) + 2;
    thread_local std::vector<float> in(size_t{kPadded} * kPadded * kPadded), out(in.size());
    const glm::ivec3 first = glm::ivec3(position * kBrickSide) - 1;
    const glm::ivec3 size = glm::ivec3(volume.size());
    read_box(volume, first, glm::ivec3(kPadded), packed(glm::uvec3(kPadded)), in.data());
    const int strides[] = {1, kPadded, kPadded * kPadded};
    for (int axis = 0; axis < 3; ++axis) {
        for (int z = 0; z < kPadded; ++z)
            for (int y = 0; y < kPadded; ++y)
                for (int x = 0; x < kPadded; ++x) {
                    const glm::ivec3 local(x, y, z);
                    const size_t at = size_t(x + kPadded * (y + kPadded * z));
                    if (local[axis] == 0 || local[axis] == kPadded - 1 || std::isnan(in[at])) {
                        out[at] = in[at];
                        continue;
                    }
                    const int index = first[axis] + local[axis];
                    const float low = in[at - size_t(strides[axis])];
                    const float high = in[at + size_t(strides[axis])];
                    const bool has_low = index > 0 && !std::isnan(low);
                    const bool has_high = index + 1 < size[axis] && !std::isnan(high);
                    const float sum =
                        2.0f * in[at] + (has_low ? low : 0.0f) + (has_high ? high : 0.0f);
                    out[at] = sum / float(2 + has_low + has_high);
                }
        std::swap(in, out);
    }
    std::vector<float> samples(kBrickSamples);
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y)
            for (uint32_t x = 0; x < kBrickSide; ++x)
                samples[offset_in_brick({x, y, z})] =
                    in[x + 1 + kPadded * (y + 1 + size_t{kPadded} * (z + 1))];
    return Brick::make(std::span<const float>(samples), volume.valid_in_brick(position));
}

} // namespace

Result<Volume> statistics_cost(const Volume& volume, const SeedValues& seeds,
                               const StatisticsCostOptions& options, const Task& task) {
    Volume smooth = volume;
    for (int pass = 0; pass < options.passes; ++pass) {
        PALPATE_TRY(smooth, make_bricks(volume.grid(), ScalarType::f32, {task.stop, {}},
                                        [&, from = smooth](glm::uvec3 position) {
                                            return smoothed_brick(from, position);
                                        }));
    }
    const double scale = 1.0 / (options.deviations * spread_of(seeds, volume));
    return map_values<float>(std::array{&std::as_const(smooth)}, task, [&](auto v) {
        if (std::isnan(v[0]))
            return v[0];
        const double off = (double(v[0]) - seeds.mean) * scale;
        return float(std::min(kLargestCost, options.floor + off * off));
    });
}

} // namespace palpate
