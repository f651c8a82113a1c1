// What a volume's own samples tell of how to feel it; declared in field.h.

#include <algorithm>
#include <cmath>
#include <vector>

#include "haptics/proxy/field.h"

namespace palpate::haptics {

namespace {

// How low and how high samples get within five of the coarsest spacings of the surface: looked for
// along the axes from where it crosses them. Quarters of all crossings, for some run along it.
Plateaus plateaus_about(const Volume& volume, double iso) {
    const glm::ivec3 size(volume.size());
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const double reach_mm = 5.0 * std::max({spacing.x, spacing.y, spacing.z});
    const int stride = std::max(1, std::max({size.x, size.y, size.z}) / 64);
    std::vector<float> lows, highs;
    for (int axis = 0; axis < 3; ++axis) {
        const int reach = static_cast<int>(std::ceil(reach_mm / spacing[axis]));
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::vector<float> line(static_cast<size_t>(size[axis]));
        glm::ivec3 at{};
        for (at[v] = 0; at[v] < size[v]; at[v] += stride)
            for (at[u] = 0; at[u] < size[u]; at[u] += stride) {
                for (at[axis] = 0; at[axis] < size[axis]; ++at[axis])
                    line[static_cast<size_t>(at[axis])] = volume.value(glm::uvec3(at));
                for (int i = 1; i < size[axis]; ++i) {
                    const float a = line[static_cast<size_t>(i - 1)];
                    const float b = line[static_cast<size_t>(i)];
                    if ((double{a} < iso) == (double{b} < iso) || a != a || b != b)
                        continue;
                    const auto begin = line.begin() + std::max(0, i - reach);
                    const auto end = line.begin() + std::min(size[axis], i + reach);
                    lows.push_back(*std::min_element(begin, end));
                    highs.push_back(*std::max_element(begin, end));
                }
            }
    }
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
    // Differences of samples two apart, scaled to a standard deviation by the median of |x| of a
    // normal distribution; edges are few, so the median does not see them.
    std::vector<float> differences, free, solid;
    const glm::uvec3 size = volume.size();
    const uint32_t stride = std::max(1u, std::max({size.x, size.y, size.z}) / 48u);
    for (uint32_t z = 0; z < size.z; z += stride)
        for (uint32_t y = 0; y < size.y; y += stride)
            for (uint32_t x = 0; x + 2 < size.x; x += stride) {
                const float a = volume.value({x, y, z}), b = volume.value({x + 2, y, z});
                if (!(a == a && b == b))
                    continue;
                differences.push_back(std::abs(a - b));
                (double{a} < iso ? free : solid).push_back(a);
            }
    if (free.empty() || solid.empty())
        return {};
    const auto median = [](std::vector<float>& values) {
        const auto middle = values.begin() + static_cast<long>(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        return double{*middle};
    };
    const auto mean = [](const std::vector<float>& values) {
        double total = 0.0;
        for (const float value : values)
            total += value;
        return total / static_cast<double>(values.size());
    };
    const double sigma = median(differences) / (0.6745 * std::sqrt(2.0));
    const double share = sigma / (mean(solid) - mean(free));
    Tuning tuning{.normal_blur_samples = share < 0.01 ? 0.0 : share < 0.04 ? 0.6 : 1.0};
    // Straightening raises noise by seven where a step has risen by 2 %, and more beyond.
    if (share < 0.002)
        tuning.plateaus = plateaus_about(volume, iso);
    return tuning;
}

double normal_blur_for(const Volume& volume, double iso) {
    return tuning_for(volume, iso).normal_blur_samples;
}

void tune(TouchParameters& parameters, const Volume& volume) {
    const Tuning tuning = tuning_for(volume, parameters.iso);
    parameters.normal_blur_samples = tuning.normal_blur_samples;
    parameters.free_value = tuning.plateaus.free;
    parameters.solid_value = tuning.plateaus.solid;
}

} // namespace palpate::haptics
