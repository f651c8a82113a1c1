#include "engine/reference/table_span.h"

#include <algorithm>
#include <cmath>

namespace palpate::reference {

namespace {

double last_of(const TransferTable& table) {
    return static_cast<double>(table.entries.size() - 1);
}

glm::dvec4 weighted(glm::dvec4 entry) {
    return glm::dvec4(glm::dvec3(entry) * entry.w, entry.w);
}

// r1 and r2 of table_span.h at the optical depth `d`.
glm::dvec2 depth_moments(double d) {
    const double z = 0.5 * d;
    if (z < 0.25) { // the difference below would cancel; the series leaves out 1e-9
        const double zz = z * z;
        return {z * (1.0 / 3.0 - zz * (1.0 / 45.0 - zz * (2.0 / 945.0 - zz * (1.0 / 4725.0)))),
                zz * (1.0 / 15.0 - zz * (2.0 / 315.0 - zz * (1.0 / 1575.0)))};
    }
    const double r1 = 1.0 / std::tanh(z) - 1.0 / z;
    return {r1, 1.0 - 3.0 * r1 / z};
}

// The smaller of two changes of one sign, else 0: what a function does on both sides of its mean,
// so that a step on one of them does not count as a slope.
glm::dvec3 least_change(glm::dvec3 a, glm::dvec3 b) {
    const glm::dvec3 least = glm::sign(a) * glm::min(glm::abs(a), glm::abs(b));
    return glm::mix(glm::dvec3(0.0), least, glm::greaterThan(a * b, glm::dvec3(0.0)));
}

double largest(glm::dvec3 v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

} // namespace

double entries_per_value(const TransferTable& table) {
    return last_of(table) / (table.high - table.low);
}

TablePoint table_point(const TransferTable& table, double value) {
    const double last = last_of(table);
    TablePoint point;
    point.place =
        std::floor((value - table.low) * entries_per_value(table) * kTableFractions + 0.5) /
        kTableFractions;
    const double inside = std::clamp(point.place, 0.0, last);
    const double low = std::min(std::floor(inside), last - 1.0);
    const size_t i = static_cast<size_t>(low);
    point.entry =
        glm::mix(glm::dvec4(table.entries[i]), glm::dvec4(table.entries[i + 1]), inside - low);
    const glm::dvec4 end(point.place < 0.0 ? table.entries.front() : table.entries.back());
    point.integral = last * glm::mix(glm::dvec4(table.integrals[i]),
                                     glm::dvec4(table.integrals[i + 1]), inside - low) +
                     (point.place - inside) * weighted(end);
    return point;
}

TableSpan table_span(const TablePoint& a, const TablePoint& b, double bend, double length_mm) {
    const double width = b.place - a.place;
    const glm::dvec3 color_a(a.entry), color_b(b.entry);
    const glm::dvec4 at_a = weighted(a.entry), at_b = weighted(b.entry);
    // Below a few entries, differences of the integral show that it is linear between entries.
    const glm::dvec4 straight(
        (glm::dvec3(at_a + at_b) * 2.0 + color_a * b.entry.w + color_b * a.entry.w) / 6.0,
        0.5 * (a.entry.w + b.entry.w));
    glm::dvec4 mean =
        std::abs(width) < kNarrowEntries ? straight : (b.integral - a.integral) / width;
    const double off = mean.w > 0.0 ? std::min(std::abs(mean.w - straight.w) / mean.w, 1.0) : 0.0;
    const double kappa = width == 0.0 ? 0.0 : std::clamp(4.0 * bend / width, -1.0, 1.0);
    mean = glm::max(mean + kappa / 6.0 * (at_b - at_a), glm::dvec4(0.0));
    if (!(mean.w > 0.0))
        return {};
    const double depth = mean.w * length_mm;
    const double slope = straight.w > 0.0 ? 0.5 * (b.entry.w - a.entry.w) / straight.w : 0.0;
    const glm::dvec3 change = color_b - color_a;
    const double k1 = 0.5 - 0.1 * slope * slope;
    const double k2 = slope * (3.0 / 7.0 * slope * slope - 1.0) / 6.0;
    const glm::dvec2 r = depth_moments(depth);
    const double ahead = k2 * r.y - k1 * r.x;
    const glm::dvec3 middle = glm::dvec3(mean) / mean.w;
    const glm::dvec3 steady = least_change((middle - color_a) / (0.5 + slope / 6.0),
                                           (color_b - middle) / (0.5 - slope / 6.0));
    const double middle_off = largest(middle - 0.5 * (color_a + color_b) - slope / 6.0 * change);
    TableSpan span;
    span.color = glm::clamp(middle + ahead * steady, 0.0, 1.0);
    span.opacity = -std::expm1(-depth);
    span.seen_at = std::clamp(0.5 + slope / 6.0 + ahead, 0.0, 1.0);
    span.error =
        span.opacity * ((middle_off + 0.5 * off * largest(change)) * r.x +
                        0.05 * largest(change) * std::min(1.0, depth * depth * depth / 840.0));
    return span;
}

double sub_step_detail(const TransferFunction& function) {
    const std::vector<double> cuts = knots(function);
    if (cuts.empty()) // iso-surfaces have none
        return 1.0;
    const double entry = (cuts.back() - cuts.front()) / static_cast<double>(kTransferTableSize - 1);
    return std::max({finest_detail(function), entry, 1e-300});
}

} // namespace palpate::reference
