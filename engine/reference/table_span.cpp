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

// The smaller of two changes of one sign, else 0: what a function does on both sides of its mean,
// so that a step on one of them does not count as a slope.
glm::dvec3 least_change(glm::dvec3 a, glm::dvec3 b) {
    const glm::dvec3 least = glm::sign(a) * glm::min(glm::abs(a), glm::abs(b));
    return glm::mix(glm::dvec3(0.0), least, glm::greaterThan(a * b, glm::dvec3(0.0)));
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
    const glm::dvec4 at_a = weighted(a.entry), at_b = weighted(b.entry);
    // Below a few entries, differences of the integral show that it is linear between entries.
    glm::dvec4 mean =
        std::abs(width) < kNarrowEntries ? 0.5 * (at_a + at_b) : (b.integral - a.integral) / width;
    const double kappa = width == 0.0 ? 0.0 : std::clamp(4.0 * bend / width, -1.0, 1.0);
    mean = glm::max(mean + kappa / 6.0 * (at_b - at_a), glm::dvec4(0.0));
    if (!(mean.w > 0.0))
        return {};
    const double depth = mean.w * length_mm;
    // A colour that changes from c_a to c_b: the front is seen better. (coth(d / 2) - 2 / d) / 2 of
    // the change, for which d / (2 sqrt(36 + d^2)) stands, within 0.01.
    const glm::dvec3 middle = glm::dvec3(mean) / mean.w;
    const glm::dvec3 change =
        2.0 * least_change(middle - glm::dvec3(a.entry), glm::dvec3(b.entry) - middle);
    const glm::dvec3 color = middle - change * (depth / (2.0 * std::sqrt(36.0 + depth * depth)));
    return {glm::clamp(color, 0.0, 1.0), -std::expm1(-depth)};
}

double sub_step_detail(const TransferFunction& function) {
    const std::vector<double> cuts = knots(function);
    if (cuts.empty()) // iso-surfaces have none
        return 1.0;
    const double entry = (cuts.back() - cuts.front()) / static_cast<double>(kTransferTableSize - 1);
    return std::max({finest_detail(function), entry, 1e-300});
}

} // namespace palpate::reference
