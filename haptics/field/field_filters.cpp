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
// Its moments are those of the spline's inverse up to the fifth, not the third: what straightened
// steps are smooth enough for.
constexpr std::array<float, 5> kSharpenMore{1.0f / 36.0f, -5.0f / 18.0f, 1.5f, -5.0f / 18.0f,
                                            1.0f / 36.0f};
// The seven taps nearest to the spline's inverse, sqrt(3) (sqrt(3) - 2)^|k|, that have its moments
// up to the fifth. Beside a kink, as in the middle of a ball of one sample, they err least.
constexpr std::array<float, 7> kSharpenMost{-0.012398601f, 0.102169387f,  -0.463756800f,
                                            1.747972030f,  -0.463756800f, 0.102169387f,
                                            -0.012398601f};
// Half way to the sharp view: see the header of Field.
constexpr std::array<float, 3> kSharpenHalf{-1.0f / 12.0f, 7.0f / 6.0f, -1.0f / 12.0f};

// The sharpened spline stays within its samples' range widened by a share of the range: half of
// what the product over the axes of the greatest sums of absolute weights (at the middle) is above
// 1. These are the sums of the three kinds of sharpening.
constexpr double kSharpenSize = 1.2222, kSharpenMoreSize = 1.3542, kSharpenMostSize = 1.5647;
constexpr double kSharpOvershoot = 0.413; // of kSharpen on all axes

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

void make_gaussian(double sigma, int reach, std::span<float> taps) {
    float sum = 0.0f;
    for (int i = -reach; i <= reach; ++i) {
        const double weight = sigma > 0.05 ? std::exp(-0.5 * i * i / (sigma * sigma)) : i == 0;
        taps[static_cast<size_t>(i + reach)] = static_cast<float>(weight);
        sum += static_cast<float>(weight);
    }
    for (int i = 0; i < 2 * reach + 1; ++i)
        taps[static_cast<size_t>(i)] /= sum;
}

// `taps` along the coarsest axes. Along finer ones a step is wide: three are exact enough, and take
// less of rounding.
Filter along_coarsest(glm::bvec3 is_coarsest, std::span<const float> taps) {
    Filter filter = everywhere(taps);
    for (int axis = 0; axis < 3; ++axis)
        if (!is_coarsest[axis]) {
            auto& fine = filter.taps[size_t(axis)];
            fine = {};
            std::copy(kSharpen.begin(), kSharpen.end(), fine.begin() + filter.reach - 1);
        }
    return filter;
}

FieldFilters make_step_filters(glm::dvec3 spacing, bool is_even) {
    const double coarsest = std::max({spacing.x, spacing.y, spacing.z});
    const glm::bvec3 is_coarsest = glm::greaterThanEqual(spacing, glm::dvec3(0.95 * coarsest));
    FieldFilters made;
    made.smooth = along_coarsest(is_coarsest, kSharpenMore);
    made.sharp = is_even ? made.smooth : along_coarsest(is_coarsest, kSharpenMost);
    made.is_one_view = is_even;
    made.sharp_reach = 2 + made.sharp.reach;
    double size = 1.0;
    for (int axis = 0; axis < 3; ++axis)
        size *= !is_coarsest[axis] ? kSharpenSize : is_even ? kSharpenMoreSize : kSharpenMostSize;
    made.overshoot = 0.5 * (size - 1.0);
    return made;
}

} // namespace

FieldFilters make_filters(const Grid& grid, double blur, bool labels, bool straightened) {
    const glm::dvec3 spacing = spacing_mm(grid);
    const double coarsest = largest_spacing_mm(grid);
    const bool is_even = coarsest < 1.05 * smallest_spacing_mm(grid);
    if (straightened)
        return make_step_filters(spacing, is_even);
    FieldFilters made;
    made.overshoot = kSharpOvershoot;
    if (labels) {
        made.sharp = everywhere(kLabelTaps);
        made.sharp_reach = 5;
    } else if (!is_even && blur > 0.0) {
        made.sharp.reach = 3;
        made.sharp_reach = 5;
        double size = 1.0;
        for (size_t axis = 0; axis < 3; ++axis)
            size *= make_wide(coarsest / spacing[static_cast<int>(axis)],
                              std::span(made.sharp.taps[axis]).first<7>());
        made.overshoot = 0.5 * (size - 1.0);
    } else {
        made.sharp = everywhere(kSharpen);
    }

    if (blur == 0.0) {
        made.smooth = everywhere(kSharpenHalf);
        return made;
    }
    // What is left beyond is 4e-6 of the middle at 0.6 samples, 3e-4 at 1.
    made.smooth.reach = !is_even ? 5 : blur <= 0.6 ? 2 : 3;
    for (size_t axis = 0; axis < 3; ++axis)
        make_gaussian(std::min(blur * coarsest / spacing[static_cast<int>(axis)], 1.9),
                      made.smooth.reach, made.smooth.taps[axis]);
    return made;
}

} // namespace palpate::haptics
