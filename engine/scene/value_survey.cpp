#include "engine/scene/value_survey.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate {

namespace {

constexpr double kVoxels = 1e5;       // looked at
constexpr uint32_t kLinesAcross = 48; // along each axis
constexpr double kBackgroundShare = 0.2;
constexpr uint64_t kFewPairs = 50; // of voxels, which prove nothing

// The value that `share` of the sorted values lie below. Not empty.
double at_share(const std::vector<float>& sorted, double share) {
    return double{sorted[static_cast<size_t>(share * static_cast<double>(sorted.size() - 1))]};
}

struct Voxels {
    std::vector<float> values; // sorted
    double equal_neighbours = 0.0;
};

Voxels sampled(const Volume& volume) {
    const glm::uvec3 size = volume.size();
    const auto stride =
        std::max(1u, static_cast<uint32_t>(
                         std::cbrt(static_cast<double>(sample_count(volume.grid())) / kVoxels)));
    const glm::uvec3 first = glm::min(glm::uvec3(stride / 2), size - 1u);
    Voxels voxels;
    uint64_t pairs = 0, equal = 0;
    for (uint32_t z = first.z; z < size.z; z += stride)
        for (uint32_t y = first.y; y < size.y; y += stride)
            for (uint32_t x = first.x; x < size.x; x += stride) {
                const glm::uvec3 here(x, y, z);
                const float value = volume.value(here);
                if (std::isnan(value))
                    continue;
                voxels.values.push_back(value);
                for (int axis = 0; axis < 3; ++axis) {
                    glm::uvec3 there = here;
                    if (value == 0.0f || ++there[axis] >= size[axis])
                        continue;
                    const float beside = volume.value(there);
                    pairs += beside != 0.0f ? 1 : 0;
                    equal += beside == value ? 1 : 0;
                }
            }
    std::sort(voxels.values.begin(), voxels.values.end());
    voxels.equal_neighbours =
        pairs >= kFewPairs ? static_cast<double>(equal) / static_cast<double>(pairs) : 0.0;
    return voxels;
}

// The value of the longest run of equal values, where it is a background; else the lowest.
double background(const std::vector<float>& sorted) {
    size_t longest = 0, start = 0;
    for (size_t i = 0; i < sorted.size();) {
        const size_t end = static_cast<size_t>(
            std::upper_bound(sorted.begin() + static_cast<ptrdiff_t>(i), sorted.end(), sorted[i]) -
            sorted.begin());
        if (end - i > longest) {
            longest = end - i;
            start = i;
        }
        i = end;
    }
    const bool common =
        static_cast<double>(longest) >= kBackgroundShare * static_cast<double>(sorted.size());
    return sorted[common && 2 * start <= sorted.size() ? start : 0];
}

// The largest value along each of a regular set of grid lines, sorted.
std::vector<float> projected_maxima(const Volume& volume) {
    const glm::uvec3 size = volume.size();
    std::vector<float> maxima;
    for (int along = 0; along < 3; ++along) {
        const int u = (along + 1) % 3, v = (along + 2) % 3;
        const uint32_t step_u = (size[u] + kLinesAcross - 1) / kLinesAcross;
        const uint32_t step_v = (size[v] + kLinesAcross - 1) / kLinesAcross;
        glm::uvec3 at(0);
        for (at[v] = (step_v - 1) / 2; at[v] < size[v]; at[v] += step_v)
            for (at[u] = (step_u - 1) / 2; at[u] < size[u]; at[u] += step_u) {
                float maximum = -INFINITY;
                for (at[along] = 0; at[along] < size[along]; ++at[along])
                    maximum = std::max(maximum, volume.value(at)); // NaN is never larger
                if (!std::isinf(maximum))
                    maxima.push_back(maximum);
            }
    }
    std::sort(maxima.begin(), maxima.end());
    return maxima;
}

} // namespace

ValueSurvey survey_values(const Volume& volume) {
    ValueSurvey survey;
    const Voxels voxels = sampled(volume);
    const std::vector<float> maxima = projected_maxima(volume);
    if (voxels.values.empty() || maxima.empty())
        return survey;
    survey.equal_neighbours = voxels.equal_neighbours;
    survey.lower_percent = at_share(voxels.values, 0.01);
    survey.upper_quarter = at_share(voxels.values, 0.75);
    survey.low = std::max(survey.lower_percent, background(voxels.values));
    const std::vector<float> above(
        std::upper_bound(voxels.values.begin(), voxels.values.end(), survey.low),
        voxels.values.end());
    survey.high = above.empty() ? volume.range().max : at_share(above, 0.995);
    if (!(survey.high > survey.low))
        survey.high = survey.low + 1.0; // one value everywhere
    const double highest = at_share(maxima, 0.999);
    const std::vector<float> met(
        std::upper_bound(maxima.begin(), maxima.end(), survey.low + 0.05 * (highest - survey.low)),
        maxima.end());
    survey.projected_high = met.empty() ? survey.high : at_share(met, 0.95);
    if (!(survey.projected_high > survey.low))
        survey.projected_high = survey.high;
    return survey;
}

bool looks_like_labels(const Volume& volume, const ValueSurvey& survey) {
    const bool whole = volume.type() == ScalarType::u8 || volume.type() == ScalarType::u16;
    return whole && volume.range().min == 0.0f && volume.range().max > 0.0f &&
           survey.equal_neighbours >= 0.8;
}

} // namespace palpate
