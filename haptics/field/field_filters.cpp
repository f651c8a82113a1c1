#include "haptics/field/field_filters.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/volume/extent.h"

namespace palpate::haptics {

namespace {

// A Gaussian of 0.5 samples. Labels are binary, and where a wall of 1.5 samples is one sample thick
// the spline reaches 0.56 with this in its middle; with 0.6 samples it would reach 0.499.
constexpr std::array<float, 7> kLabelTaps{1.197946e-08f, 0.0002638651f, 0.1064508f,   0.7865707f,
                                          0.1064508f,    0.0002638651f, 1.197946e-08f};
constexpr std::array<float, 3> kSharpen{-1.0f / 6.0f, 4.0f / 3.0f, -1.0f / 6.0f};
// Its moments are those of the spline's inverse up to the fifth, not the third. With the fourth the
// surface of a body of few samples no longer sinks: a needle's of a radius of two by 0.11 samples
// instead of 0.14. In noise it would be rougher.
constexpr std::array<float, 5> kSharpenMore{1.0f / 36.0f, -5.0f / 18.0f, 1.5f, -5.0f / 18.0f,
                                            1.0f / 36.0f};
// The sharpened spline stays within its samples' range widened by a share of the range: half of
// what the product over the axes of the greatest sums of absolute weights (at the middle) is above
// 1. These are the sums of the two kinds of sharpening.
constexpr double kSharpenSize = 1.2222, kSharpenMoreSize = 1.3542;

// A blur has two limits: a variance v below which a sampled Gaussian's is less by more than a
// hundredth, 8 pi^2 v^2 exp(-2 pi^2 v), and the most that its reach has room for.
constexpr double kLeastGaussian = 0.4, kWidest_samples = 1.9;

double overshoot_of(double size) {
    return 0.5 * (size * size * size - 1.0);
}

Filter everywhere(std::span<const float> taps) {
    Filter filter{.reach = static_cast<int>(taps.size() / 2)};
    for (auto& axis : filter.taps)
        std::copy(taps.begin(), taps.end(), axis.begin());
    return filter;
}

// G(k) (a + b k^2) with sum 1 and second moment -1/3, which cancels the spline's: as exact as the
// sharpening by three taps, with less noise. `coarseness` is the coarsest spacing in the axis's
// own. Returns the sum of the taps' sizes.
double make_wide(double coarseness, std::span<float, 7> taps) {
    constexpr int kReach = 3;
    const double width = coarseness > 1.5 ? std::min(0.4 * coarseness, 1.3) : 0.0;
    double m0 = 0.0, m2 = 0.0, m4 = 0.0;
    std::array<double, 2 * kReach + 1> g{};
    for (int k = -kReach; k <= kReach; ++k) {
        const double weight =
            width > 0.0 ? std::exp(-0.5 * k * k / (width * width)) : (std::abs(k) <= 1 ? 1.0 : 0.0);
        g[static_cast<size_t>(k + kReach)] = weight;
        m0 += weight;
        m2 += weight * k * k;
        m4 += weight * k * k * k * k;
    }
    const double det = m0 * m4 - m2 * m2;
    const double a = (m4 + m2 / 3.0) / det, b = (-m0 / 3.0 - m2) / det;
    double size = 0.0;
    for (int k = -kReach; k <= kReach; ++k) {
        const double tap = g[static_cast<size_t>(k + kReach)] * (a + b * k * k);
        taps[static_cast<size_t>(k + kReach)] = static_cast<float>(tap);
        size += std::abs(tap);
    }
    return size;
}

// Makes a blur of this variance, from -1/3 on: with three taps if it is small, for a narrow
// Gaussian cannot be sampled.
void make_blur(double variance, int reach, std::span<float, 2 * Filter::kMostReach + 1> taps) {
    const auto middle = static_cast<size_t>(reach);
    if (variance < kLeastGaussian) {
        taps[middle - 1] = taps[middle + 1] = static_cast<float>(0.5 * variance);
        taps[middle] = static_cast<float>(1.0 - variance);
        return;
    }
    double sum = 0.0;
    for (int i = -reach; i <= reach; ++i)
        sum += std::exp(-0.5 * i * i / variance);
    for (int i = -reach; i <= reach; ++i)
        taps[static_cast<size_t>(i + reach)] =
            static_cast<float>(std::exp(-0.5 * i * i / variance) / sum);
}

} // namespace

FieldFilters make_filters(const Grid& grid, double blur, double edge, bool labels) {
    const glm::dvec3 spacing = spacing_mm(grid);
    const double coarsest = largest_spacing_mm(grid);
    const bool is_even = coarsest < 1.05 * smallest_spacing_mm(grid);
    FieldFilters made;
    if (labels) {
        made.sharp = everywhere(kLabelTaps);
    } else if (!(blur > 0.0)) {
        made.sharp = everywhere(kSharpenMore);
        made.overshoot = overshoot_of(kSharpenMoreSize);
    } else if (is_even) {
        made.sharp = everywhere(kSharpen);
        made.overshoot = overshoot_of(kSharpenSize);
    } else {
        made.sharp.reach = 3;
        double size = 1.0;
        for (size_t axis = 0; axis < 3; ++axis)
            size *= make_wide(coarsest / spacing[static_cast<int>(axis)],
                              std::span(made.sharp.taps[axis]).first<7>());
        made.overshoot = 0.5 * (size - 1.0);
    }
    made.sharp_reach = 2 + made.sharp.reach;

    // As much in mm on every axis, with the spline's third of a sample on each: what blurs the axes
    // differently turns normals where a surface bends. Beyond its reach is left less than 2e-3 of a
    // tap in the middle, and 7e-3 of the widest.
    const double least = labels ? 0.0 : kEdgeBlur_samples * kEdgeBlur_samples - edge * edge;
    const double variance = blur > 0.0 || labels ? std::max(blur * blur, least) : least;
    glm::dvec3 variances;
    for (int axis = 0; axis < 3; ++axis) {
        const double square = coarsest * coarsest / (spacing[axis] * spacing[axis]);
        variances[axis] = std::clamp((variance + 1.0 / 3.0) * square - 1.0 / 3.0, -1.0 / 3.0,
                                     kWidest_samples * kWidest_samples);
    }
    const double widest = std::max({variances.x, variances.y, variances.z, 0.0});
    const double reach = 3.5 * std::sqrt(widest) - 1.0;
    made.smooth.reach = reach <= 1.0 ? 1 : reach <= 2.0 ? 2 : reach <= 3.0 ? 3 : 5;
    for (int axis = 0; axis < 3; ++axis)
        make_blur(variances[axis], made.smooth.reach, made.smooth.taps[size_t(axis)]);
    return made;
}

} // namespace palpate::haptics
