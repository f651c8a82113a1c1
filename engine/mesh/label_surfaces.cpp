#include "engine/mesh/label_surfaces.h"

#include <numeric>

#include "engine/base/assert.h"
#include "engine/mesh/used_positions.h"

namespace palpate {

namespace {

// visit(label, n) for both sides of every triangle n.
template <class Visit>
void for_each_side(const Mesh& mesh, const Visit& visit) {
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        visit(mesh.labels[n], static_cast<uint32_t>(n));
        if (!mesh.outer_labels.empty() && mesh.outer_labels[n] != mesh.labels[n])
            visit(mesh.outer_labels[n], static_cast<uint32_t>(n));
    }
}

} // namespace

void for_each_label(const Mesh& mesh,
                    const std::function<void(uint16_t label, const Mesh& surface)>& visit) {
    PALPATE_ASSERT_CMP(mesh.labels.size(), ==, mesh.triangles.size());
    PALPATE_ASSERT_CMP(mesh.triangles.size(), <, size_t{1} << 32);
    // Triangles by label, in their order: counted, then put in place.
    constexpr size_t kLabels = size_t{1} << 16;
    std::vector<size_t> first(kLabels + 1, 0);
    for_each_side(mesh, [&](uint16_t label, uint32_t) { ++first[label + size_t{1}]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> numbers(first.back());
    std::vector<size_t> next(first.begin(), first.end() - 1);
    for_each_side(mesh, [&](uint16_t label, uint32_t n) { numbers[next[label]++] = n; });

    std::vector<uint32_t> renamed;
    for (size_t l = 0; l < kLabels; ++l) {
        if (first[l] == first[l + 1])
            continue;
        const auto label = static_cast<uint16_t>(l);
        Mesh surface{.world_from_mesh = mesh.world_from_mesh};
        for (size_t i = first[l]; i < first[l + 1]; ++i) {
            const uint32_t n = numbers[i];
            const glm::uvec3 t = mesh.triangles[n];
            surface.triangles.push_back(mesh.labels[n] == label ? t : glm::uvec3(t.x, t.z, t.y));
        }
        take_used_positions(mesh, surface, renamed);
        surface.labels.assign(surface.triangles.size(), label);
        visit(label, surface);
    }
}

} // namespace palpate
