#include "engine/measure/label_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "engine/mesh/label_surfaces.h"
#include "engine/mesh/topology.h"
#include "engine/surface/surface_nets.h"

namespace palpate {

PrincipalAxes principal_axes(const glm::dmat3& covariance_mm2) {
    // Jacobi rotations: each makes one pair of off-diagonal elements 0.
    glm::dmat3 m = covariance_mm2, axes(1.0);
    for (int turn = 0; turn < 60; ++turn) {
        const int p = turn % 3 == 2 ? 1 : 0, q = turn % 3 == 0 ? 1 : 2;
        if (m[p][q] == 0.0)
            continue;
        const double angle = 0.5 * std::atan2(2.0 * m[p][q], m[p][p] - m[q][q]);
        glm::dmat3 rotation(1.0);
        rotation[p][p] = rotation[q][q] = std::cos(angle);
        rotation[p][q] = std::sin(angle);
        rotation[q][p] = -rotation[p][q];
        m = glm::transpose(rotation) * m * rotation;
        axes = axes * rotation;
    }
    std::array<int, 3> order{0, 1, 2};
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return m[a][a] > m[b][b]; });
    PrincipalAxes out{};
    for (int i = 0; i < 3; ++i) {
        glm::dvec3 direction = glm::normalize(axes[order[size_t(i)]]);
        int largest = 0;
        for (int k = 1; k < 3; ++k)
            if (std::abs(direction[k]) > std::abs(direction[largest]) + 1e-9)
                largest = k;
        out.direction[size_t(i)] = direction[largest] < 0.0 ? -direction : direction;
        out.semi_axes_mm[i] = std::sqrt(5.0 * std::max(m[order[size_t(i)]][order[size_t(i)]], 0.0));
    }
    return out;
}

std::optional<std::map<uint16_t, LabelSurface>> label_surfaces(const Volume& labels,
                                                               const std::stop_token& stop) {
    const Mesh mesh = surface_nets(labels, {.passes = 20, .stop = stop});
    if (stop.stop_requested())
        return std::nullopt;
    std::map<uint16_t, LabelSurface> out;
    for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
        if (label == 0)
            return;
        const MeshTopology found = topology(surface);
        const double ball =
            std::cbrt(36.0 * std::numbers::pi * found.volume_mm3 * found.volume_mm3);
        out[label] = {found.area_mm2, found.volume_mm3, ball / found.area_mm2};
    });
    return out;
}

} // namespace palpate
