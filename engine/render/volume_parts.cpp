#include "engine/render/volume_parts.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

// Samples beyond a slab that cubic interpolation reads, and one for rounding.
constexpr double kFilterReach = 3.0;

double samples_per_mm(const Grid& grid) {
    const glm::dmat3 rows = glm::transpose(glm::dmat3(index_from_world(grid)));
    return std::max({glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2])});
}

// Whether a plane, `half_mm` thick to either side, meets a box of the index space.
bool meets(const SliceLayer& slice, double half_mm, const Grid& grid, glm::dvec3 low,
           glm::dvec3 high) {
    const glm::dvec3 normal = glm::normalize(slice.normal);
    double least = 1e300, most = -1e300;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index(corner & 1 ? high.x : low.x, corner >> 1 & 1 ? high.y : low.y,
                               corner >> 2 ? high.z : low.z);
        const double d = glm::dot(normal, world_point(grid, index) - slice.point_mm);
        least = std::min(least, d);
        most = std::max(most, d);
    }
    return least <= half_mm && most >= -half_mm;
}

} // namespace

double reach_samples(const RayCastLayer& layer, const Grid& grid, double step_factor) {
    return std::max(2.0, step_factor * step_mm_of(layer, grid) * samples_per_mm(grid) + 1.0);
}

BrickMask bricks_for_rays(const RayCastLayer& layer, const Volume& volume, const CellMap& cells,
                          double step_factor) {
    if (layer.mode == RayMode::mip)
        return needed_bricks(volume);
    return needed_bricks(volume.brick_count(), cells.distances(), cells.count(), cells.side(),
                         reach_samples(layer, volume.grid(), step_factor));
}

std::vector<glm::uvec3> bricks_for_slices(const Scene& scene, const Volume& volume) {
    const BrickMask mask = needed_bricks(volume);
    const Grid& grid = volume.grid();
    const double reach_mm = kFilterReach * glm::length(spacing_mm(grid));
    std::vector<glm::uvec3> bricks;
    size_t i = 0;
    for_each_brick(volume, [&](glm::uvec3 p) {
        if (!mask[i++])
            return;
        const glm::dvec3 low = glm::dvec3(p * kBrickSide);
        const glm::dvec3 high = low + static_cast<double>(kBrickSide);
        for (const SliceLayer& slice : scene.slices)
            if (meets(slice, 0.5 * slice.slab_mm + reach_mm, grid, low, high)) {
                bricks.push_back(p);
                return;
            }
    });
    return bricks;
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
