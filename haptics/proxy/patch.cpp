#include "haptics/proxy/patch.h"

#include <algorithm>
#include <cmath>

#include "haptics/proxy/coupling.h"
#include "haptics/proxy/samples.h"

namespace palpate::haptics {

glm::dmat4 Patch::mesh_from_world(const Volume& volume) {
    return glm::inverse(world_from_mesh(volume.grid()));
}

void Patch::extract(const Volume& volume, glm::dvec3 world_mm, const TouchParameters& p) {
    const glm::dvec3 index = glm::clamp(index_point(volume.grid(), world_mm), -1e6, 1e6);
    const glm::ivec3 first = glm::ivec3(glm::round(index - 0.5 * (side_ - 1.0)));
    const float lowest = std::min(volume.range().empty() ? 0.0f : volume.range().min,
                                  static_cast<float>(p.iso) - 1.0f);
    lacked_brick_ = copy_resident(volume, first, glm::ivec3(side_), lowest, samples_.data());
    const size_t count = size_t(side_) * size_t(side_) * size_t(side_);
    const bool labels = p.source == TouchSource::labels;
    for (size_t i = 0; i < count; ++i) {
        if (labels)
            samples_[i] = samples_[i] > 0.0f ? 1.0f : 0.0f;
        else if (p.opacity.point_count > 0)
            samples_[i] = static_cast<float>(strength_n(p.opacity, double{samples_[i]}));
    }
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    low_ = glm::dvec3(first) * spacing;
    high_ = low_ + (side_ - 1.0) * spacing;
    const LocalSurface::Patch made =
        surface_.extract(std::span<const float>(samples_.data(), count), glm::vec3(spacing),
                         glm::vec3(low_), labels ? 0.5f : static_cast<float>(p.iso));
    span_ = {made.positions, made.normals, made.triangles};
}

void Patch::mean_filter() {
    const size_t count = span_.positions.size();
    if (count > kMostPositions)
        return;
    std::copy(span_.positions.begin(), span_.positions.end(), filtered_.begin());
    std::fill(weights_.begin(), weights_.begin() + static_cast<long>(count), 1.0f);
    for (const glm::uvec3 t : span_.triangles)
        for (int k = 0; k < 3; ++k) {
            const uint32_t a = t[k], b = t[(k + 1) % 3];
            // Each inner edge is met twice, once from either side: once for either end.
            filtered_[a] += span_.positions[b];
            weights_[a] += 1.0f;
        }
    for (size_t i = 0; i < count; ++i)
        filtered_[i] /= weights_[i];
    span_.positions = {filtered_.data(), count};
}

} // namespace palpate::haptics
