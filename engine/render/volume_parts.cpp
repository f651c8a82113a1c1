#include "engine/render/volume_parts.h"

#include <algorithm>

namespace palpate {

namespace {

double samples_per_mm(const Grid& grid) {
    const glm::dmat3 rows = glm::transpose(glm::dmat3(index_from_world(grid)));
    return std::max({glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2])});
}

} // namespace

double reach_samples(const RayCastLayer& layer, const Grid& grid, double step_factor) {
    return std::max(2.0, step_factor * step_mm_of(layer, grid) * samples_per_mm(grid) + 1.0);
}

gpu::AtlasFrame make_atlas_frame(BrickAtlas& atlas, const Volume& volume, const Part& part,
                                 bool first) {
    constexpr float beyond = 1e30f; // the outermost faces cut nothing
    const glm::uvec3 texels = atlas.image().shape().size;
    const glm::uvec3 count = volume.brick_count();
    gpu::AtlasFrame frame{};
    frame.pages_texture = glm::vec3(1.0 / glm::dvec3(count));
    frame.image_texture = glm::vec3(1.0 / glm::dvec3(texels));
    // A position is rounded when it is moved to its slot, when it becomes a texture coordinate, and
    // when the device turns that into texels: three times 2^-24 of the image's side at most.
    frame.inset = 4.0f * static_cast<float>(std::max({texels.x, texels.y, texels.z})) / 16777216.0f;
    for (int axis = 0; axis < 3; ++axis) {
        frame.part_low[axis] =
            part.low[axis] == 0 ? -beyond : static_cast<float>(part.low[axis] * kBrickSide);
        frame.part_high[axis] = part.high[axis] == count[axis]
                                    ? beyond
                                    : static_cast<float>(part.high[axis] * kBrickSide);
    }
    frame.part_eyes = part.eyes;
    frame.first_part = first ? 1 : 0;
    return frame;
}

} // namespace palpate
