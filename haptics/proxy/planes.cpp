#include "haptics/proxy/planes.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr double kTolerance_mm = 1e-9;

// The point of the planes' common face nearest to goal; none where they are nearly dependent.
std::optional<dvec3> on_all(dvec3 goal, std::span<const Plane> planes,
                            std::span<const uint32_t> which) {
    const auto gap = [&](uint32_t i) {
        return planes[i].offset - glm::dot(planes[i].normal, goal);
    };
    if (which.size() == 1)
        return goal + gap(which[0]) * planes[which[0]].normal;
    const dvec3 a = planes[which[0]].normal, b = planes[which[1]].normal;
    if (which.size() == 2) {
        const double c = glm::dot(a, b), det = 1.0 - c * c;
        if (det < 1e-9)
            return {};
        const double ga = gap(which[0]), gb = gap(which[1]);
        return goal + ((ga - c * gb) * a + (gb - c * ga) * b) / det;
    }
    const dvec3 c = planes[which[2]].normal;
    const dvec3 bc = glm::cross(b, c);
    const double det = glm::dot(a, bc);
    if (std::abs(det) < 1e-6)
        return {};
    return goal + (gap(which[0]) * bc + gap(which[1]) * glm::cross(c, a) +
                   gap(which[2]) * glm::cross(a, b)) /
                      det;
}

} // namespace

Projection project_to_planes(dvec3 goal, std::span<const Plane> planes) {
    Projection found{.point = goal};
    const size_t limit = 4 * planes.size() + 8;
    for (size_t step = 0; step < limit; ++step) {
        double worst = -kTolerance_mm;
        uint32_t joining = 0;
        for (uint32_t i = 0; i < planes.size(); ++i) {
            const double slack = glm::dot(planes[i].normal, found.point) - planes[i].offset;
            if (slack < worst) {
                worst = slack;
                joining = i;
            }
        }
        if (worst == -kTolerance_mm)
            return found;

        // Subsets of the active planes (bits) that hold together with the joining one.
        std::array<uint32_t, 4> all{};
        uint32_t count = 0;
        for (; count < found.active_count; ++count)
            all[count] = found.active[count];
        all[count] = joining;
        Projection best{.is_feasible = false};
        double best_distance = INFINITY;
        for (uint32_t bits = 0; bits < 1u << count; ++bits) {
            std::array<uint32_t, 4> subset{};
            uint32_t size = 0;
            subset[size++] = joining;
            for (uint32_t i = 0; i < count; ++i)
                if (bits >> i & 1)
                    subset[size++] = all[i];
            if (size > 3)
                continue;
            const auto point = on_all(goal, planes, {subset.data(), size});
            if (!point)
                continue;
            bool holds = true;
            for (uint32_t i = 0; i <= count && holds; ++i)
                holds = glm::dot(planes[all[i]].normal, *point) >=
                        planes[all[i]].offset - 10.0 * kTolerance_mm;
            const double distance = glm::distance(*point, goal);
            if (holds && distance < best_distance) {
                best_distance = distance;
                best = {.point = *point, .is_feasible = true, .active_count = size};
                std::copy(subset.begin(), subset.begin() + size, best.active.begin());
            }
        }
        if (!best.is_feasible) {
            found.is_feasible = false;
            return found;
        }
        found = best;
    }
    found.is_feasible = false;
    return found;
}

} // namespace palpate::haptics
