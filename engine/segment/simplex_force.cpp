#include <algorithm>
#include <cmath>

#include "engine/segment/simplex_mesh.h"
#include "engine/volume/extent.h"
#include "engine/volume/sample.h"

namespace palpate {

SimplexForce toward_surface(const Volume& signed_distance) {
    const glm::dmat4 to_index = index_from_world(signed_distance.grid());
    const double by = 0.25 * smallest_spacing_mm(signed_distance.grid());
    return [=](std::span<const SimplexPlace> places, std::span<glm::dvec3> pulls) {
        SampleCursor cursor(signed_distance);
        for (size_t i = 0; i < places.size(); ++i) {
            const auto distance = [&](double off) {
                const glm::dvec3 at = places[i].position_mm + off * places[i].normal;
                return cursor.value(glm::dvec3(to_index * glm::dvec4(at, 1.0)));
            };
            const double slope = (distance(by) - distance(-by)) / (2.0 * by);
            const double pull = -distance(0.0) * std::clamp(slope, -1.0, 1.0);
            pulls[i] = std::isnan(pull) ? glm::dvec3(0.0) : pull * places[i].normal;
        }
    };
}

SimplexForce toward_edges(const Volume& volume, double range_mm) {
    const glm::dmat4 to_index = index_from_world(volume.grid());
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const double by = 0.5 * std::min({spacing.x, spacing.y, spacing.z});
    const int reach = std::max(int(range_mm / by), 0);
    return [=](std::span<const SimplexPlace> places, std::span<glm::dvec3> pulls) {
        SampleCursor cursor(volume);
        for (size_t i = 0; i < places.size(); ++i) {
            const auto value = [&](int step) {
                const glm::dvec3 at = places[i].position_mm + double(step) * by * places[i].normal;
                return cursor.value(glm::dvec3(to_index * glm::dvec4(at, 1.0)));
            };
            double strongest = 0.0;
            int best = 0;
            double before = value(-reach - 1), here = value(-reach);
            for (int k = -reach; k <= reach; ++k) {
                const double after = value(k + 1), change = std::abs(after - before);
                if (change > strongest || (change == strongest && std::abs(k) < std::abs(best))) {
                    strongest = change; // NaN is in neither
                    best = k;
                }
                before = here;
                here = after;
            }
            pulls[i] = double(best) * by * places[i].normal;
        }
    };
}

} // namespace palpate
