// What a volume's own samples tell of how to feel it; declared in field.h.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/volume/extent.h"
#include "haptics/field/field.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;
using glm::ivec3;

// Samples' differences across a sample, in values a mm of the world.
dvec3 slope_at(const Volume& volume, ivec3 at) {
    const ivec3 last = ivec3(volume.size()) - 1;
    dvec3 slope;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 low = at, high = at;
        low[axis] = std::max(at[axis] - 1, 0);
        high[axis] = std::min(at[axis] + 1, last[axis]);
        slope[axis] =
            (double{volume.value(glm::uvec3(high))} - double{volume.value(glm::uvec3(low))}) /
            std::max(1, high[axis] - low[axis]);
    }
    return world_gradient(volume.grid(), slope);
}

// The highest sample on a way from one, in steps of the world; `sign` -1: the lowest.
float most_along(const Volume& volume, dvec3 from, dvec3 step, int steps, float sign) {
    float most = -INFINITY;
    for (int i = 0; i <= steps; ++i) {
        const dvec3 at = glm::round(from + double(i) * step);
        if (glm::any(glm::lessThan(at, dvec3(0.0))) ||
            glm::any(glm::greaterThanEqual(at, dvec3(volume.size()))))
            break;
        most = std::max(most, sign * volume.value(glm::uvec3(at)));
    }
    return sign * most;
}

// Calls crossing(axis, at) for each sample of lines along the axes, some 64 by 64 of them, that
// lies on another side of the iso-value than the one before it; in order along each line.
template <class Crossing>
void for_crossings(const Volume& volume, double iso, const Crossing& crossing) {
    const ivec3 size(volume.size());
    const int stride = std::max(1, std::max({size.x, size.y, size.z}) / 64);
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        ivec3 at{};
        for (at[v] = 0; at[v] < size[v]; at[v] += stride)
            for (at[u] = 0; at[u] < size[u]; at[u] += stride) {
                float before = NAN;
                for (at[axis] = 0; at[axis] < size[axis]; ++at[axis]) {
                    const float a = std::exchange(before, volume.value(glm::uvec3(at)));
                    if ((double{a} < iso) != (double{before} < iso) && a == a && before == before)
                        crossing(axis, at);
                }
            }
    }
}

double grains_about(const Volume& volume, double iso) {
    constexpr int kGrain = 3;
    uint64_t crossings = 0, grains = 0;
    ivec3 last(-1);
    for_crossings(volume, iso, [&](int axis, ivec3 at) {
        ivec3 off = at - std::exchange(last, at);
        const int way = std::exchange(off[axis], 0);
        ++crossings;
        grains += off == ivec3(0) && way > 0 && way <= kGrain;
    });
    return crossings > 0 ? static_cast<double>(grains) / static_cast<double>(crossings) : 0.0;
}

// How low and how high samples get within five of the coarsest spacings of the surface: looked for
// along its normals, for a body may be smaller than that across other ways, and from where the axes
// cross it. Quarters of all, for some normals are wrong.
Plateaus plateaus_about(const Volume& volume, double iso) {
    const double step_mm = 0.5 * smallest_spacing_mm(volume.grid());
    const int steps =
        static_cast<int>(std::ceil(5.0 * largest_spacing_mm(volume.grid()) / step_mm));
    const glm::dmat3 to_index(index_from_world(volume.grid()));
    std::vector<float> lows, highs;
    for_crossings(volume, iso, [&](int, ivec3 at) {
        const dvec3 slope = slope_at(volume, at);
        const double steepness = glm::length(slope);
        if (!(steepness > 0.0))
            return;
        const dvec3 step = to_index * (step_mm / steepness * slope);
        lows.push_back(most_along(volume, dvec3(at), -step, steps, -1.0f));
        highs.push_back(most_along(volume, dvec3(at), step, steps, 1.0f));
    });
    if (lows.empty())
        return {};
    const auto quarter = [](std::vector<float>& values, size_t of_four) {
        const auto at = values.begin() + static_cast<long>((values.size() - 1) * of_four / 4);
        std::nth_element(values.begin(), at, values.end());
        return double{*at};
    };
    return {quarter(lows, 1), quarter(highs, 3)};
}

} // namespace

Tuning tuning_for(const Volume& volume, double iso) {
    // Of second differences over two samples, which a slope does not enter, on either side of the
    // surface for itself: a masked background is constant and says nothing. Scaled to a standard
    // deviation by the tenth of |x| of a normal distribution, for bodies are mostly edge, and the
    // root of 1 + 4 + 1. Over two samples noise that a kernel of one sample has correlated is seen
    // by 0.72 of it, over one by 0.29.
    constexpr uint32_t kApart = 2;
    std::vector<float> free_bends, solid_bends, free, solid;
    const glm::uvec3 size = volume.size();
    const uint32_t stride = std::max(1u, std::max({size.x, size.y, size.z}) / 48u);
    for (uint32_t z = 0; z < size.z; z += stride)
        for (uint32_t y = 0; y < size.y; y += stride)
            for (uint32_t x = 0; x + 2 * kApart < size.x; x += stride) {
                const float a = volume.value({x, y, z}), b = volume.value({x + kApart, y, z}),
                            c = volume.value({x + 2 * kApart, y, z});
                if (!(a == a && b == b && c == c))
                    continue;
                const bool is_free = double{b} < iso;
                (is_free ? free : solid).push_back(b);
                (is_free ? free_bends : solid_bends).push_back(std::abs(a - 2.0f * b + c));
            }
    if (free.empty() || solid.empty())
        return {};
    // A side of few samples is mostly edge: it says nothing.
    const size_t few = (free.size() + solid.size()) / 10;
    const auto sigma_of = [&](std::vector<float>& bends) {
        if (bends.size() <= few)
            return 0.0;
        const auto at = bends.begin() + static_cast<long>(bends.size() / 10);
        std::nth_element(bends.begin(), at, bends.end());
        return double{*at} / (0.12566 * std::sqrt(6.0));
    };
    const auto mean = [](const std::vector<float>& values) {
        double total = 0.0;
        for (const float value : values)
            total += value;
        return total / static_cast<double>(values.size());
    };
    const double sigma = std::max(sigma_of(free_bends), sigma_of(solid_bends));
    const double share = sigma / (mean(solid) - mean(free));
    Tuning tuning{.normal_blur_samples = share < 0.01   ? 0.0
                                         : share < 0.04 ? 0.6
                                                        : 1.0,
                  .grains = grains_about(volume, iso)};
    // Straightening raises noise by seven where a step has risen by 2 %, and more beyond.
    if (share < 0.002)
        tuning.plateaus = plateaus_about(volume, iso);
    return tuning;
}

Tuning tune(TouchParameters& parameters, const Volume& volume) {
    const Tuning tuning = tuning_for(volume, parameters.iso);
    parameters.normal_blur_samples = tuning.normal_blur_samples;
    parameters.free_value = tuning.plateaus.free;
    parameters.solid_value = tuning.plateaus.solid;
    return tuning;
}

} // namespace palpate::haptics
