#include "engine/scene/transfer_function.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// Piecewise-linear value of points sorted by .value; at a step the later point counts.
template <class Points, class Field>
auto interpolate(const Points& points, double value, Field field) {
    PALPATE_ASSERT(!points.empty());
    const auto after =
        std::upper_bound(points.begin(), points.end(), value,
                         [](double v, const auto& point) { return v < point.value; });
    if (after == points.begin())
        return field(points.front());
    const auto before = after - 1;
    if (after == points.end())
        return field(*before);
    const double t = (value - before->value) / (after->value - before->value);
    return field(*before) * (1.0 - t) + field(*after) * t;
}

// Gauss-Legendre points on [-1, 1]: exact for polynomials up to degree 9.
constexpr double kGaussX[] = {0.0, -0.5384693101056831, 0.5384693101056831, -0.9061798459386640,
                              0.9061798459386640};
constexpr double kGaussW[] = {0.5688888888888889, 0.4786286704993665, 0.4786286704993665,
                              0.2369268850561891, 0.2369268850561891};

} // namespace

glm::dvec3 color_at(const TransferFunction& function, double value) {
    return interpolate(function.colors, value, [](const auto& p) { return p.color; });
}

double opacity_at(const TransferFunction& function, double value) {
    return interpolate(function.opacities, value, [](const auto& p) { return p.opacity; });
}

double tau_per_mm_at(const TransferFunction& function, double value) {
    return -std::log1p(-std::min(opacity_at(function, value), kMaxOpacity)) /
           function.opacity_unit_mm;
}

std::vector<double> knots(const TransferFunction& function) {
    std::vector<double> values;
    for (const auto& point : function.colors)
        values.push_back(point.value);
    for (const auto& point : function.opacities)
        values.push_back(point.value);
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    return values;
}

double finest_detail(const TransferFunction& function) {
    const auto has_step = [](const auto& points) {
        return std::adjacent_find(points.begin(), points.end(), [](const auto& a, const auto& b) {
                   return a.value == b.value;
               }) != points.end();
    };
    if (has_step(function.colors) || has_step(function.opacities))
        return 0.0;
    const std::vector<double> values = knots(function);
    double finest = std::numeric_limits<double>::infinity();
    for (size_t i = 1; i < values.size(); ++i)
        finest = std::min(finest, values[i] - values[i - 1]);
    return finest;
}

TransferFunction window_function(double low, double high, double max_opacity,
                                 double opacity_unit_mm) {
    return {{{low, glm::dvec3(0.0)}, {high, glm::dvec3(1.0)}},
            {{low, 0.0}, {high, max_opacity}},
            opacity_unit_mm};
}

TransferFunction mirrored(const TransferFunction& function) {
    const std::vector<double> cuts = knots(function);
    TransferFunction result = function;
    std::reverse(result.colors.begin(), result.colors.end());
    std::reverse(result.opacities.begin(), result.opacities.end());
    // The ends to the bit.
    const auto turned = [&](double value) {
        return value == cuts.front()  ? cuts.back()
               : value == cuts.back() ? cuts.front()
                                      : cuts.front() + (cuts.back() - value);
    };
    for (auto& point : result.colors)
        point.value = turned(point.value);
    for (auto& point : result.opacities)
        point.value = turned(point.value);
    return result;
}

bool shows_after(const TransferTable& table, size_t entry) {
    return entry + 1 < table.integrals.size() &&
           table.integrals[entry + 1].w > table.integrals[entry].w;
}

TransferTable make_table(const TransferFunction& function, size_t size) {
    PALPATE_ASSERT_CMP(size, >=, size_t{2});
    TransferTable table;
    PALPATE_ASSERT(!function.colors.empty() && !function.opacities.empty());
    const std::vector<double> cuts = knots(function);
    table.low = cuts.front();
    table.high = cuts.back();
    if (table.high <= table.low) { // one value everywhere
        table.low -= 0.5;
        table.high = table.low + 1.0;
    }
    const double width = table.high - table.low;
    const auto value_of = [&](size_t i) {
        return i + 1 == size
                   ? table.high
                   : table.low + width * static_cast<double>(i) / static_cast<double>(size - 1);
    };
    table.entries.resize(size);
    table.integrals.resize(size);
    glm::dvec4 sum(0.0);
    auto next_cut = std::upper_bound(cuts.begin(), cuts.end(), table.low);
    double from = table.low;
    for (size_t i = 0; i < size; ++i) {
        const double value = value_of(i);
        // Smooth pieces between knots, so that the integral is exact to rounding.
        while (from < value) {
            double to = value;
            if (next_cut != cuts.end() && *next_cut < value)
                to = *next_cut++;
            for (int g = 0; g < 5; ++g) {
                const double at = 0.5 * ((to - from) * kGaussX[g] + (to + from));
                const double tau = tau_per_mm_at(function, at);
                sum +=
                    0.5 * (to - from) * kGaussW[g] * glm::dvec4(color_at(function, at) * tau, tau);
            }
            from = to;
        }
        while (next_cut != cuts.end() && *next_cut <= value)
            ++next_cut;
        table.entries[i] = glm::vec4(glm::vec3(color_at(function, value)),
                                     static_cast<float>(tau_per_mm_at(function, value)));
        table.integrals[i] = glm::vec4(sum / width);
    }
    return table;
}

} // namespace palpate
