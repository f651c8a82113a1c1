#include <algorithm>
#include <cmath>

#include "engine/segment/simplex_mesh.h"
#include "engine/volume/sample.h"

namespace palpate {

SimplexForce toward_surface(const Volume& signed_distance) {
    const glm::dmat4 to_index = index_from_world(signed_distance.grid());
    return [signed_distance, to_index](glm::dvec3 p, glm::dvec3 normal) {
        const double d = trilinear(signed_distance, glm::dvec3(to_index * glm::dvec4(p, 1.0)));
        return std::isnan(d) ? glm::dvec3(0.0) : -d * normal;
    };
}

SimplexForce toward_edges(const Volume& volume, double range_mm) {
    const glm::dmat4 to_index = index_from_world(volume.grid());
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const double by = 0.5 * std::min({spacing.x, spacing.y, spacing.z});
    const int reach = std::max(int(range_mm / by), 0);
    return [=](glm::dvec3 p, glm::dvec3 normal) {
        const auto value = [&](int i) {
            const glm::dvec3 at = p + double(i) * by * normal;
            return trilinear(volume, glm::dvec3(to_index * glm::dvec4(at, 1.0)));
        };
        double strongest = 0.0;
        int best = 0;
        double before = value(-reach - 1), here = value(-reach);
        for (int i = -reach; i <= reach; ++i) {
            const double after = value(i + 1), change = std::abs(after - before);
            if (change > strongest || (change == strongest && std::abs(i) < std::abs(best))) {
                strongest = change; // NaN is in neither
                best = i;
            }
            before = here;
            here = after;
        }
        return double(best) * by * normal;
    };
}

} // namespace palpate
