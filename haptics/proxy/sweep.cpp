#include "haptics/proxy/sweep.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

namespace {

using glm::dvec3;

// The part of the segment, 0 .. 1, that lies in the volume and some samples about it.
glm::dvec2 part_near_volume(const Field& field, dvec3 from, dvec3 to) {
    constexpr double kMargin = 6.0; // samples; what the field reads beyond
    const dvec3 a = field.index_of(from), d = field.index_of(to) - a;
    const dvec3 last = dvec3(field.volume()->size()) - 1.0;
    double enter = 0.0, leave = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = -kMargin - a[axis], high = last[axis] + kMargin - a[axis];
        if (d[axis] == 0.0) {
            if (low > 0.0 || high < 0.0)
                return {1.0, 0.0};
            continue;
        }
        enter = std::max(enter, std::min(low / d[axis], high / d[axis]));
        leave = std::min(leave, std::max(low / d[axis], high / d[axis]));
    }
    return {enter, leave};
}

// The root between a free and a solid place by the Illinois method.
double root(Field& field, dvec3 from, dvec3 direction, double free_mm, double free_value,
            double solid_mm, double solid_value, Budget& budget) {
    const double tolerance = 1e-7 * field.contrast();
    double a = free_mm, fa = free_value - field.iso();
    double b = solid_mm, fb = solid_value - field.iso();
    // An end that has not been looked at may be solid by rounding: then it is the root.
    if (fa >= 0.0)
        return a;
    int side = 0;
    for (int i = 0; i < 24; ++i) {
        const double middle = (a * fb - b * fa) / (fb - fa);
        budget.spend();
        const double f = field.value(from + middle * direction) - field.iso();
        if (std::abs(f) < tolerance || b - a < 1e-9)
            return middle;
        if (f < 0.0) {
            a = middle;
            fa = f;
            if (side == -1)
                fb *= 0.5;
            side = -1;
        } else {
            b = middle;
            fb = f;
            if (side == 1)
                fa *= 0.5;
            side = 1;
        }
    }
    return a;
}

} // namespace

Sweep sweep(Field& field, dvec3 from, dvec3 to, Budget& budget) {
    const double length = glm::distance(from, to);
    if (field.is_empty() || length < 1e-9)
        return {to};
    const dvec3 direction = (to - from) / length;
    const glm::dvec2 part = part_near_volume(field, from, to);
    if (part.x > part.y)
        return {to};
    const double end = std::min(length, part.y * length);
    const double step = 0.25 * field.voxel_mm(), leap = 8.0 * field.voxel_mm();
    double t = std::max(0.0, part.x * length);
    double value = -INFINITY; // at t, once looked at
    while (t < end) {
        const double next = std::min(end, t + leap);
        if (length > 2.0 * field.voxel_mm()) {
            if (!budget.spend())
                return {from + t * direction};
            if (field.is_clear(from + t * direction, from + next * direction, 0.0)) {
                t = next;
                value = -INFINITY;
                continue;
            }
        }
        while (t < next) {
            const double ahead = std::min(next, t + step);
            if (!budget.spend())
                return {from + t * direction};
            const double found = field.value(from + ahead * direction);
            if (found >= field.iso()) {
                if (!std::isfinite(value))
                    value = field.value(from + t * direction);
                const double at = root(field, from, direction, t, value, ahead, found, budget);
                return {from + at * direction, true};
            }
            t = ahead;
            value = found;
        }
    }
    return {to};
}

} // namespace palpate::haptics
