// Measures a volume's own samples to tell how to feel it; declared in field.h.

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

// Samples' differences across a sample, in values a mm of the world. Those along an axis blur it by
// a third of its spacing's square, so the others are blurred as much: else an edge that is narrower
// than a sample were turned away from the axis that is nearest to its normal.
dvec3 slope_at(const Volume& volume, ivec3 at) {
    const ivec3 last = ivec3(volume.size()) - 1;
    dvec3 slope(0);
    ivec3 off;
    for (off.z = -1; off.z <= 1; ++off.z)
        for (off.y = -1; off.y <= 1; ++off.y)
            for (off.x = -1; off.x <= 1; ++off.x) {
                const double value = volume.value(glm::uvec3(glm::clamp(at + off, ivec3(0), last)));
                const dvec3 blur = glm::mix(dvec3(2.0 / 3.0), dvec3(1.0 / 6.0), dvec3(off * off));
                slope += 0.5 * dvec3(off) * value *
                         dvec3(blur.y * blur.z, blur.z * blur.x, blur.x * blur.y);
            }
    return world_gradient(volume.grid(), slope);
}

constexpr double kEdgeReach_samples = 2.5; // to either side

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

// Sums over a stretch of a line on which values rise or fall: of its differences, each placed in
// the middle between its samples.
struct Rise {
    double all = 0.0, first = 0.0, second = 0.0;

    void add(double difference, double place) {
        all += difference;
        first += difference * place;
        second += difference * place * place;
    }
    // The variance of the edge itself: a difference of samples is a mean over one, a twelfth wider.
    double variance() const { return second / all - first * first / (all * all) - 1.0 / 12.0; }
};

// Adds up to `most` differences on one side of the crossing, of which `from` is the nearest sample.
// Of a body so thin that values come back to iso, those up to its middle; an overshoot is the
// edge's own.
void add_side(Rise& rise, const Volume& volume, double iso, ivec3 from, ivec3 way, int most) {
    const auto value = [&](ivec3 at) { return double{volume.value(glm::uvec3(at))}; };
    const int sign = way.x + way.y + way.z;
    const bool is_solid = value(from) >= iso;
    double last = value(from), farthest = last;
    Rise until_middle = rise;
    for (int i = 1; i <= most; ++i) {
        from += way;
        if (glm::any(glm::lessThan(from, ivec3(0))) ||
            glm::any(glm::greaterThanEqual(from, ivec3(volume.size()))))
            return;
        const double next = value(from);
        if ((next >= iso) != is_solid || next != next) {
            rise = until_middle;
            return;
        }
        rise.add(sign * (next - last), sign * i);
        last = next;
        if (is_solid ? next > farthest : next < farthest) {
            farthest = next;
            until_middle = rise;
        }
    }
}

// How wide the edge is, as TouchParameters::edge_samples, whatever its shape: the median over where
// lines along the axes cross the surface nearly along its normal. A line at a slant crosses an edge
// that is longer by 1 / along, among samples that are as far apart as always: so what samples add
// to the variance is taken off along the line, and the rest is turned to the normal.
double edge_about(const Volume& volume, double iso) {
    const double coarsest = largest_spacing_mm(volume.grid());
    std::vector<double> variances;
    for_crossings(volume, iso, [&](int axis, ivec3 at) {
        const dvec3 slope = slope_at(volume, at),
                    step(glm::dmat3(volume.grid().world_from_index)[axis]);
        const double spacing = glm::length(step) / coarsest,
                     along =
                         std::abs(glm::dot(slope, step)) / (glm::length(slope) * glm::length(step));
        if (!(3.0 * along * along >= 1.0)) // some axis is that near to every normal
            return;
        ivec3 way{};
        way[axis] = 1;
        const int most = static_cast<int>(std::lround(kEdgeReach_samples / (spacing * along)));
        Rise rise;
        rise.add(double{volume.value(glm::uvec3(at))} - double{volume.value(glm::uvec3(at - way))},
                 0.0);
        add_side(rise, volume, iso, at, way, most);
        add_side(rise, volume, iso, at - way, -way, most);
        const double square = spacing * along * spacing * along;
        variances.push_back(std::max(0.0, rise.variance()) * square);
    });
    if (variances.empty())
        return 0.0;
    const auto middle = variances.begin() + static_cast<long>(variances.size() / 2);
    std::nth_element(variances.begin(), middle, variances.end());
    return std::min(1.0, std::sqrt(*middle));
}

} // namespace

Tuning tuning_for(const Volume& volume, double iso) {
    // Noise comes from second differences over two samples, which a slope does not enter, on either
    // side of the surface for itself: a masked background is constant and says nothing. Scaled to a
    // standard deviation by the tenth of |x| of a normal distribution, for bodies are mostly edge,
    // and the root of 1 + 4 + 1. Over two samples noise that a kernel of one sample has correlated
    // is seen by 0.72 of it, over one by 0.29.
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
    return {.normal_blur_samples = share < 0.01   ? 0.0
                                   : share < 0.04 ? 0.6
                                                  : 1.0,
            .edge_samples = edge_about(volume, iso),
            .grains = grains_about(volume, iso)};
}

Tuning tune(TouchParameters& parameters, const Volume& volume) {
    const Tuning tuning = tuning_for(volume, parameters.iso);
    parameters.normal_blur_samples = tuning.normal_blur_samples;
    parameters.edge_samples = tuning.edge_samples;
    return tuning;
}

} // namespace palpate::haptics
