#include "engine/segment/march_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/segment/edges.h"
#include "engine/segment/flood.h"
#include "engine/segment/label_samples.h"
#include "engine/segment/map_values.h"
#include "engine/segment/seed_places.h"
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

namespace {

// The p-quantile, 0 where there is none.
double quantile(std::vector<float>& values, double p) {
    if (values.empty())
        return 0.0;
    const auto at = values.begin() + ptrdiff_t(p * double(values.size() - 1));
    std::ranges::nth_element(values, at);
    return double{*at};
}

// A few seeds with what lies beside them.
void take_neighbours(const Volume& volume, const Volume& seeds, SeedValues& values) {
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    const auto near = [](const glm::ivec3& a, const glm::ivec3& b) {
        return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
    };
    std::set<glm::ivec3, decltype(near)> block(near);
    for_each_of_label(seeds, values.label, [&](glm::ivec3 at) {
        const glm::ivec3 low = glm::max(at - 1, glm::ivec3(0)), high = glm::min(at + 1, last);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x)
                    block.insert({x, y, z});
    });
    std::vector<float> differences;
    for (const glm::ivec3& at : block)
        for (int k = 0; k < 3; ++k) {
            glm::ivec3 to = at;
            ++to[k];
            if (!block.contains(to))
                continue;
            const float by = volume.value(glm::uvec3(to)) - volume.value(glm::uvec3(at));
            if (!std::isnan(by))
                differences.push_back(std::abs(by));
        }
    const double noise = 1.05 * quantile(differences, 0.5), mean = values.mean;
    double sum = 0.0, count = 0.0;
    for (const glm::ivec3& at : block) {
        const double v = volume.value(glm::uvec3(at));
        if (std::abs(v - mean) <= 3.0 * std::sqrt(2.0) * noise)
            sum += v, ++count;
    }
    if (count > 0.0)
        values.mean = sum / count;
    values.sd = std::max(values.sd, noise);
}

// How far values go on from the mean across the faces of an object.
double contrast_of(const Volume& volume, const Volume& object, const SeedValues& values) {
    constexpr int kLongest = 16; // samples of an edge
    const glm::ivec3 size(volume.size());
    std::vector<float> contrasts;
    for_each_of_label(object, values.label, [&](glm::ivec3 at) {
        for (int side = 0; side < 6; ++side) {
            glm::ivec3 step(0), to = at;
            step[side / 2] = side % 2 == 0 ? -1 : 1;
            double off = 0.0;
            for (int n = 0; n < kLongest; ++n) {
                to += step;
                if (glm::any(glm::lessThan(to, glm::ivec3(0))) ||
                    glm::any(glm::greaterThanEqual(to, size)) ||
                    (n == 0 && object.value(glm::uvec3(to)) == float(values.label)))
                    break;
                const double next = std::abs(double{volume.value(glm::uvec3(to))} - values.mean);
                if (!(next > off))
                    break;
                off = next;
            }
            if (off > 0.0)
                contrasts.push_back(float(off));
        }
    });
    return quantile(contrasts, 0.2);
}

Result<Volume> smoothed(const Volume& volume, int passes, const Task& task) {
    Volume smooth = volume;
    for (int pass = 0; pass < passes; ++pass) {
        PALPATE_TRY(smooth, make_bricks(volume.grid(), ScalarType::f32, {task.stop, {}},
                                        [&, from = smooth](glm::uvec3 position) {
                                            return smoothed_brick(from, position);
                                        }));
    }
    return smooth;
}

} // namespace

Result<ObjectValues> object_values(const Volume& volume, const Volume& given, uint16_t label,
                                   std::span<const SeedBall> balls, double deviations,
                                   const Task& task) {
    PALPATE_TRY(const Volume smooth, smoothed(volume, 1, task));
    const Volume seeds = settled_seeds(volume, smooth, given, label, balls);
    const std::vector<SeedValues> own = seed_values(volume, seeds);
    if (own.empty())
        return ObjectValues{};
    SeedValues values = own[0];
    if (values.count < kFewSeeds)
        take_neighbours(volume, seeds, values);
    values.sd = spread_of(values, volume);
    const double reach = deviations * values.sd;
    const LabelInterval interval{values.label, {values.mean - reach, values.mean + reach}};
    PALPATE_TRY(const Volume object,
                region_growing(volume, seeds, std::span(&interval, 1), Neighbors::face_6, task));
    const double contrast = contrast_of(smooth, object, values);
    values.sd = std::max(values.sd, contrast / 10.0);
    return ObjectValues{values, contrast};
}

Result<Volume> statistics_cost(const Volume& volume, const SeedValues& seeds,
                               const StatisticsCostOptions& options, const Task& task) {
    PALPATE_TRY(const Volume smooth, smoothed(volume, options.passes, task));
    const double scale = 1.0 / (options.deviations * spread_of(seeds, volume));
    return map_values<float>(std::array{&std::as_const(smooth)}, task, [&](auto v) {
        if (std::isnan(v[0]))
            return v[0];
        const double off = (double(v[0]) - seeds.mean) * scale;
        return float(std::min(kLargestCost, options.floor + off * off));
    });
}

} // namespace palpate
