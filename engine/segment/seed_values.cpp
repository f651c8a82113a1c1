#include "engine/segment/seed_values.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "engine/volume/grid.h"

namespace palpate {

namespace {

constexpr double kTwoKinds = 4.0; // standard deviations

using Place = std::tuple<uint32_t, uint32_t, uint32_t>;

// Samples of balls whose value is not of the kind that the ball's central sample has.
std::set<Place> strays_of(const Volume& volume, std::span<const SeedBall> balls) {
    std::set<Place> strays;
    const glm::dvec3 h = spacing_mm(volume.grid()), last = glm::dvec3(volume.size()) - 1.0;
    for (const SeedBall& ball : balls) {
        const glm::dvec3 center = index_point(volume.grid(), ball.center_mm);
        const auto sample = [&](glm::dvec3 at) {
            return glm::uvec3(glm::clamp(glm::round(at), glm::dvec3(0.0), last));
        };
        const glm::dvec3 reach = std::sqrt(3.0) * ball.radius_mm / h; // also of sheared grids
        const glm::uvec3 low = sample(center - reach), high = sample(center + reach);
        std::vector<float> values;
        const auto each = [&](const auto& visit) {
            for (uint32_t z = low.z; z <= high.z; ++z)
                for (uint32_t y = low.y; y <= high.y; ++y)
                    for (uint32_t x = low.x; x <= high.x; ++x)
                        if (glm::distance(world_point(volume.grid(), glm::dvec3(x, y, z)),
                                          ball.center_mm) <= ball.radius_mm)
                            if (const float v = volume.value({x, y, z}); !std::isnan(v))
                                visit({x, y, z}, v);
        };
        each([&](glm::uvec3, float v) { values.push_back(v); });
        std::ranges::sort(values);
        const std::optional<float> upper = upper_kind(values);
        const float own = volume.value(sample(center));
        if (!upper || std::isnan(own))
            continue;
        each([&](glm::uvec3 at, float v) {
            if ((v >= *upper) != (own >= *upper))
                strays.emplace(at.z, at.y, at.x);
        });
    }
    return strays;
}

} // namespace

std::optional<float> upper_kind(const std::vector<float>& ascending) {
    const auto n = double(ascending.size());
    double sum = 0.0, squares = 0.0;
    for (const float v : ascending)
        sum += double{v}, squares += double{v} * double{v};
    double below = 0.0, least = INFINITY, apart = 0.0;
    std::optional<float> found;
    for (size_t i = 1; i < ascending.size(); ++i) {
        below += double{ascending[i - 1]};
        if (ascending[i] == ascending[i - 1])
            continue;
        const double low = below / double(i), high = (sum - below) / (n - double(i));
        const double within =
            squares / n - (double(i) * low * low + (n - double(i)) * high * high) / n;
        if (within < least)
            least = within, apart = high - low, found = ascending[i];
    }
    return apart > kTwoKinds * std::sqrt(std::max(least, 0.0)) ? found : std::nullopt;
}

std::vector<SeedValues> seed_values(const Volume& volume, const Volume& seeds,
                                    std::span<const SeedBall> balls) {
    const std::set<Place> strays = strays_of(volume, balls);
    std::map<uint16_t, SeedValues> found;
    // Two passes: the mean, and then squares of what lies beside it.
    for (const bool is_second : {false, true}) {
        for_each_brick(seeds, [&](glm::uvec3 position) {
            const Brick& labels = seeds.brick(position);
            if (!(labels.range().max > 0.0f))
                return;
            const Brick& grey = volume.brick(position);
            const Brick::Pinned label_pin = labels.pin(), grey_pin = grey.pin();
            const glm::uvec3 valid = seeds.valid_in_brick(position);
            for (uint32_t z = 0; z < valid.z; ++z)
                for (uint32_t y = 0; y < valid.y; ++y)
                    for (uint32_t x = 0; x < valid.x; ++x) {
                        const uint32_t at = offset_in_brick({x, y, z});
                        const float label = labels.value(label_pin, at);
                        const double value = label > 0.0f ? grey.value(grey_pin, at) : NAN;
                        if (std::isnan(value))
                            continue;
                        const glm::uvec3 place = position * kBrickSide + glm::uvec3(x, y, z);
                        if (!strays.empty() && strays.contains({place.z, place.y, place.x}))
                            continue;
                        SeedValues& of = found[static_cast<uint16_t>(label)];
                        if (is_second)
                            of.sd += (value - of.mean) * (value - of.mean);
                        else
                            ++of.count, of.mean += value;
                    }
        });
        for (auto& [label, of] : found)
            if (is_second)
                of.sd = std::sqrt(of.sd / double(of.count));
            else
                of.mean /= double(of.count);
    }
    std::vector<SeedValues> values;
    for (auto& [label, of] : found) {
        of.label = label;
        values.push_back(of);
    }
    return values;
}

double spread_of(const SeedValues& values, const Volume& volume) {
    const ValueRange range = volume.range();
    const double least = range.empty() ? 0.0 : (double(range.max) - double(range.min)) / 500.0;
    const double spread = std::max(values.sd, least);
    return spread > 0.0 ? spread : 1.0;
}

} // namespace palpate
