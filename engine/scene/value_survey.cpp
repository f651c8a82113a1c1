#include "engine/scene/value_survey.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate {

namespace {

constexpr double kVoxels = 1e5;       // looked at
constexpr uint32_t kLinesAcross = 48; // along each axis
constexpr uint32_t kAlongEdge = 256;  // of the box
constexpr double kBackgroundShare = 0.2;
constexpr double kManyTimes = 10.0; // as many on one side of a background as on the other
constexpr double kNoiseWidths = 3.0;
constexpr double kLeastShare = 2e-4; // of the voxels, beside a background with noise
constexpr double kApart = 4.0;
constexpr double kOutlierShare = 1e-4; // of pairs of neighbours, which outliers may form
constexpr uint64_t kFewPairs = 50;     // of voxels, which prove nothing

// The value that `share` of the sorted values lie below. Not empty.
double at_share(const std::vector<float>& sorted, double share) {
    return double{sorted[static_cast<size_t>(share * static_cast<double>(sorted.size() - 1))]};
}

float median(float a, float b, float c) {
    return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

// Values in rising order, and what neighbours have in common: for each the highest and the lowest
// value that it or a neighbour along an axis reaches in a pair at least. So a single sample that
// stands out is in `all` alone.
struct Values {
    std::vector<float> all, in_pairs_high, in_pairs_low;

    void add(float value, float high, float low) {
        all.push_back(value);
        in_pairs_high.push_back(high);
        in_pairs_low.push_back(low);
    }
    void sort() {
        for (std::vector<float>* list : {&all, &in_pairs_high, &in_pairs_low})
            std::sort(list->begin(), list->end());
    }
};

// The values times -1, again in rising order.
std::vector<float> turned_over(const std::vector<float>& sorted) {
    std::vector<float> turned;
    turned.reserve(sorted.size());
    for (auto value = sorted.rbegin(); value != sorted.rend(); ++value)
        turned.push_back(-*value);
    return turned;
}

struct Voxels {
    Values values;
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
                float high = -INFINITY, low = INFINITY;
                for (int axis = 0; axis < 3; ++axis) {
                    glm::uvec3 there = here;
                    if (++there[axis] >= size[axis])
                        continue;
                    const float beside = volume.value(there);
                    if (value != 0.0f) {
                        pairs += beside != 0.0f ? 1 : 0;
                        equal += beside == value ? 1 : 0;
                    }
                    if (here[axis] == 0 || std::isnan(beside))
                        continue;
                    there[axis] -= 2;
                    if (const float before = volume.value(there); !std::isnan(before)) {
                        const float middle = median(before, value, beside);
                        high = std::max(high, middle);
                        low = std::min(low, middle);
                    }
                }
                const bool alone = std::isinf(high);
                voxels.values.add(value, alone ? value : high, alone ? value : low);
            }
    voxels.values.sort();
    voxels.equal_neighbours =
        pairs >= kFewPairs ? static_cast<double>(equal) / static_cast<double>(pairs) : 0.0;
    return voxels;
}

// ValueSurvey::like_hounsfield, of values in rising order.
bool like_hounsfield(const std::vector<float>& sorted, double high) {
    const auto within = [&](float from, float to) {
        return static_cast<double>(std::upper_bound(sorted.begin(), sorted.end(), to) -
                                   std::lower_bound(sorted.begin(), sorted.end(), from));
    };
    const double air = within(-1100.0f, -700.0f), rims = within(-650.0f, -250.0f),
                 tissue = within(-200.0f, 200.0f), body = within(-250.0f, INFINITY);
    return air >= 0.01 * static_cast<double>(sorted.size()) && air >= 2.0 * rims &&
           tissue >= 2.0 * rims && tissue >= 0.4 * body && tissue > 0.0 && high > 0.0 &&
           high < 4000.0;
}

// The value of the longest run of equal values, where it is a dark background; else the lowest.
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
    const auto below = static_cast<double>(start), count = static_cast<double>(longest),
               all = static_cast<double>(sorted.size());
    const bool is_dark =
        count >= kBackgroundShare * all && kManyTimes * below <= all - below - count;
    return double{sorted[is_dark ? start : 0]};
}

// The largest value along each of a regular set of grid lines in `highest.all`, and what two
// samples in a row reach in `highest.in_pairs_high`; the smallest in `lowest`.
struct Lines {
    Values highest, lowest;
};

Lines extremes_of_lines(const Volume& volume) {
    const glm::uvec3 size = volume.size();
    Lines lines;
    for (int along = 0; along < 3; ++along) {
        const int u = (along + 1) % 3, v = (along + 2) % 3;
        const uint32_t step_u = (size[u] + kLinesAcross - 1) / kLinesAcross;
        const uint32_t step_v = (size[v] + kLinesAcross - 1) / kLinesAcross;
        glm::uvec3 at(0);
        for (at[v] = (step_v - 1) / 2; at[v] < size[v]; at[v] += step_v)
            for (at[u] = (step_u - 1) / 2; at[u] < size[u]; at[u] += step_u) {
                float high = -INFINITY, low = INFINITY, pair_high = -INFINITY, pair_low = INFINITY;
                float before = NAN;
                for (at[along] = 0; at[along] < size[along]; ++at[along]) {
                    const float value = volume.value(at);
                    high = std::max(high, value); // NaN is never larger
                    low = std::min(low, value);
                    if (!std::isnan(value) && !std::isnan(before)) {
                        pair_high = std::max(pair_high, std::min(before, value));
                        pair_low = std::min(pair_low, std::max(before, value));
                    }
                    before = value;
                }
                if (std::isinf(high))
                    continue;
                const bool alone = std::isinf(pair_high);
                lines.highest.add(high, alone ? high : pair_high, 0.0f);
                lines.lowest.add(low, 0.0f, alone ? low : pair_low);
            }
    }
    lines.highest.sort();
    lines.lowest.sort();
    return lines;
}

// Along the edges of the box of samples, in rising order. Empty where most of them have no data.
// A volume of one line of samples has its ends.
std::vector<float> values_on_edges(const Volume& volume) {
    const glm::uvec3 last = volume.size() - 1u;
    std::vector<float> values;
    size_t looked_at = 0;
    for (int along = 0; along < 3; ++along) {
        const int u = (along + 1) % 3, v = (along + 2) % 3;
        if (last[u] == 0 && last[v] == 0)
            continue;
        const uint32_t step = last[along] / kAlongEdge + 1;
        for (int edge = 0; edge < 4; ++edge) {
            glm::uvec3 at(0);
            at[u] = (edge & 1) ? last[u] : 0;
            at[v] = (edge & 2) ? last[v] : 0;
            for (; at[along] <= last[along]; at[along] += step) {
                ++looked_at;
                if (const float value = volume.value(at); !std::isnan(value))
                    values.push_back(value);
            }
        }
    }
    if (2 * values.size() < looked_at)
        return {};
    std::sort(values.begin(), values.end());
    return values;
}

std::optional<double> bright_background(const Volume& volume, const std::vector<float>& sorted) {
    const std::vector<float> edges = values_on_edges(volume);
    if (edges.empty())
        return std::nullopt;
    const double middle = at_share(edges, 0.5);
    const double width = kNoiseWidths * (at_share(edges, 0.75) - at_share(edges, 0.25));
    const double dark = middle - width, bright = middle + width;
    auto below = static_cast<double>(
        std::count_if(sorted.begin(), sorted.end(), [&](float v) { return double{v} < dark; }));
    auto above = static_cast<double>(
        std::count_if(sorted.begin(), sorted.end(), [&](float v) { return double{v} > bright; }));
    if (below == 0.0 && above == 0.0) { // what is there lies between the voxels looked at
        below = double{volume.range().min} < dark ? 1.0 : 0.0;
        above = double{volume.range().max} > bright ? 1.0 : 0.0;
    }
    const double least = width > 0.0 ? kLeastShare * static_cast<double>(sorted.size()) : 0.0;
    return below > least && kManyTimes * above <= below ? std::optional(middle) : std::nullopt;
}

// The end of a projection's values, from maxima along lines.
double projected_end(const std::vector<float>& maxima, double low, double high) {
    const double highest = at_share(maxima, 0.999);
    const std::vector<float> met(
        std::upper_bound(maxima.begin(), maxima.end(), low + 0.05 * (highest - low)), maxima.end());
    const double end = met.empty() ? high : at_share(met, 0.95);
    return end > low ? end : high;
}

struct Ends {
    double low, high, projected;
};

// Ends of values whose background, if they have one, is dark. `most` is the largest of all samples.
Ends ends_of(const std::vector<float>& values, const std::vector<float>& in_pairs,
             const std::vector<float>& maxima, const std::vector<float>& maxima_in_pairs,
             double most) {
    Ends ends{};
    ends.low = std::max(at_share(values, 0.01), background(values));
    const std::vector<float> above(std::upper_bound(values.begin(), values.end(), ends.low),
                                   values.end());
    ends.high = above.empty() ? most : at_share(above, 0.995);
    const double usual = at_share(in_pairs, 1.0 - kOutlierShare);
    if (usual > ends.low && ends.high - ends.low > kApart * (usual - ends.low))
        ends.high = usual;
    if (!(ends.high > ends.low))
        ends.high = ends.low + 1.0; // one value everywhere
    ends.projected = projected_end(maxima, ends.low, ends.high);
    const double in_rows = projected_end(maxima_in_pairs, ends.low, ends.high);
    if (ends.projected - ends.low > kApart * (in_rows - ends.low))
        ends.projected = in_rows;
    return ends;
}

} // namespace

ValueSurvey survey_values(const Volume& volume) {
    ValueSurvey survey;
    const Voxels voxels = sampled(volume);
    const Values& values = voxels.values;
    const Lines lines = extremes_of_lines(volume);
    if (values.all.empty() || lines.highest.all.empty())
        return survey;
    survey.equal_neighbours = voxels.equal_neighbours;
    survey.lower_percent = at_share(values.all, 0.01);
    survey.upper_quarter = at_share(values.all, 0.75);
    survey.bright_background = bright_background(volume, values.all);
    if (survey.bright_background) {
        const Ends ends =
            ends_of(turned_over(values.all), turned_over(values.in_pairs_low),
                    turned_over(lines.lowest.all), turned_over(lines.lowest.in_pairs_low),
                    -double{volume.range().min});
        survey.low = -ends.high;
        survey.high = survey.projected_high = -ends.low;
        survey.projected_low = -ends.projected;
        survey.like_hounsfield = like_hounsfield(values.all, survey.high);
        return survey;
    }
    const Ends ends = ends_of(values.all, values.in_pairs_high, lines.highest.all,
                              lines.highest.in_pairs_high, double{volume.range().max});
    survey.low = survey.projected_low = ends.low;
    survey.high = ends.high;
    survey.projected_high = ends.projected;
    survey.like_hounsfield = like_hounsfield(values.all, survey.high);
    return survey;
}

bool looks_like_labels(const Volume& volume, const ValueSurvey& survey) {
    const bool whole = volume.type() == ScalarType::u8 || volume.type() == ScalarType::u16;
    return whole && volume.range().min == 0.0f && volume.range().max > 0.0f &&
           survey.equal_neighbours >= 0.8 && !survey.bright_background;
}

} // namespace palpate
