#include "engine/measure/label_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "engine/mesh/label_surfaces.h"
#include "engine/mesh/topology.h"
#include "engine/surface/surface_nets.h"

namespace palpate {

namespace {

// A label's samples as boxes.
struct Boxes {
    uint64_t samples = 0, blocks = 0; // of 2 x 2 x 2, which may overlap
    double faces_mm2 = 0.0;           // between it and other labels or the border
};

// By label. Nothing where `stop` was asked.
std::optional<std::vector<Boxes>> boxes_of_labels(const Volume& labels,
                                                  const std::stop_token& stop) {
    const glm::uvec3 size = labels.size();
    const glm::dmat3 axes(labels.grid().world_from_index);
    const glm::dvec3 face_mm2(glm::length(glm::cross(axes[1], axes[2])),
                              glm::length(glm::cross(axes[2], axes[0])),
                              glm::length(glm::cross(axes[0], axes[1])));
    std::vector<Boxes> boxes(size_t{1} << 16);
    // A row between two samples of background; background beyond the volume.
    using Row = std::vector<float>;
    const auto read = [&](uint32_t y, uint32_t z, Row& row) { // of y - 1 and z - 1
        row.assign(size_t{size.x} + 2, 0.0f);
        if (y >= 1 && y <= size.y && z >= 1 && z <= size.z)
            read_row(labels, {0, y - 1, z - 1}, size.x, row.data() + 1);
    };
    const auto meet = [&](float a, float b, double mm2) {
        if (a == b)
            return;
        boxes[static_cast<uint16_t>(a)].faces_mm2 += mm2;
        boxes[static_cast<uint16_t>(b)].faces_mm2 += mm2;
    };
    Row here, after_y, after_z, after_both;
    for (uint32_t z = 0; z <= size.z; ++z) {
        if (stop.stop_requested())
            return std::nullopt;
        read(0, z, after_y);
        read(0, z + 1, after_both);
        for (uint32_t y = 0; y <= size.y; ++y) {
            here.swap(after_y);
            after_z.swap(after_both);
            read(y + 1, z, after_y);
            read(y + 1, z + 1, after_both);
            for (size_t x = 0; x <= size.x; ++x) {
                const float label = here[x];
                meet(label, here[x + 1], face_mm2.x);
                meet(label, after_y[x], face_mm2.y);
                meet(label, after_z[x], face_mm2.z);
                Boxes& own = boxes[static_cast<uint16_t>(label)];
                ++own.samples;
                bool is_block = true;
                for (const Row* row : {&here, &after_y, &after_z, &after_both})
                    is_block = is_block && (*row)[x] == label && (*row)[x + 1] == label;
                own.blocks += is_block ? 1 : 0;
            }
        }
    }
    return boxes;
}

} // namespace

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
    const auto boxes = boxes_of_labels(labels, stop);
    if (stop.stop_requested() || !boxes)
        return std::nullopt;
    std::map<uint16_t, LabelSurface> out;
    for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
        if (label == 0)
            return;
        const MeshTopology found = topology(surface);
        const double ball =
            std::cbrt(36.0 * std::numbers::pi * found.volume_mm3 * found.volume_mm3);
        LabelSurface& one = out[label];
        one = {found.area_mm2, found.volume_mm3, ball / found.area_mm2};
        const Boxes& box = (*boxes)[label];
        if (2 * 8 * box.blocks < box.samples)
            one.note = fmt::format(
                "one sample thick: the area is of a surface that smoothing makes thinner; the "
                "faces of the samples have {:g} mm2",
                box.faces_mm2);
    });
    return out;
}

} // namespace palpate
