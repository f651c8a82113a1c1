#include "engine/render/changed_pixels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/render/seen_box.h"
#include "engine/render/targets.h"
#include "engine/surface/block_nets.h"
#include "engine/volume/changes.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// In samples: of cubic interpolation, and of differences between neighbours that are interpolated.
constexpr double kReach = 2.0;

bool shows_walls(const Scene& scene) {
    return std::ranges::any_of(scene.surfaces, &SurfaceLayer::live_labels);
}

// In samples: how far from a changed label the walls between labels move, or their normals turn.
double reach_of_walls() {
    const BlockNetsOptions walls;
    return kStepsOfRound * walls.rounds + walls.normal_rounds + 3.0;
}

// Whether a surface of the scene is made from its volume.
bool follows(const Scene& scene) {
    return std::any_of(scene.surfaces.begin(), scene.surfaces.end(),
                       [](const SurfaceLayer& layer) { return layer.live_iso.has_value(); });
}

bool meets(const SliceLayer& slice, const Grid& grid, const AxisBox& box) {
    const glm::dvec3 normal = glm::normalize(slice.normal);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index(corner & 1 ? box.high.x : box.low.x,
                               corner & 2 ? box.high.y : box.low.y,
                               corner & 4 ? box.high.z : box.low.z);
        const double at = glm::dot(normal, world_point(grid, index) - slice.point_mm);
        low = std::min(low, at);
        high = std::max(high, at);
    }
    return low <= 0.5 * slice.slab_mm && high >= -0.5 * slice.slab_mm;
}

// Boxes that hold all samples that differ: one a changed block of samples, or one a brick where
// many bricks have changed.
std::vector<ChangedBox> boxes_of_change(const Volume& before, const Volume& after) {
    constexpr size_t kFewBricks = 64;
    const std::vector<ChangedBrick> bricks = changed_bricks(before, after);
    std::vector<ChangedBox> all;
    for (const ChangedBrick& brick : bricks) {
        if (bricks.size() > kFewBricks) {
            const auto [low, high] = changed_samples(brick);
            const glm::ivec3 first(brick.position * kBrickSide);
            all.push_back({first + glm::ivec3(low), first + glm::ivec3(high) - 1});
            continue;
        }
        const std::vector<ChangedBox> boxes = changed_boxes(before, after, brick);
        all.insert(all.end(), boxes.begin(), boxes.end());
    }
    return all;
}

} // namespace

PixelBox united(const PixelBox& a, const PixelBox& b) {
    if (a.empty() || b.empty())
        return a.empty() ? b : a;
    return {glm::min(a.low, b.low), glm::max(a.high, b.high)};
}

PixelBox of_whole_tiles(const PixelBox& box, glm::uvec2 size_px) {
    const uint32_t side = gpu::kTileSide;
    return {box.low / side * side, glm::min((box.high + (side - 1)) / side * side, size_px)};
}

PixelBox changed_pixels(const Scene& scene, const Volume& before, const Volume& after) {
    const PixelBox all{glm::uvec2(0), scene.size_px};
    if (before.is_same_as(after))
        return {};
    if (before.grid() != after.grid() || before.type() != after.type() || follows(scene))
        return all;
    // Outlines of labels look so far; and a pixel beyond for rounding.
    const double outline_px = std::max(scene.labels ? double(scene.labels->outline_px) : 0.0, 0.0);
    const glm::dvec2 margin_px(std::ceil(outline_px) + 1.0);
    const std::vector<View> views = views_of(scene);
    const bool has_walls = shows_walls(scene);
    const double reach = has_walls ? reach_of_walls() : kReach;
    PixelBox changed;
    for (const ChangedBox& samples : boxes_of_change(before, after)) {
        const AxisBox box{glm::dvec3(samples.first) - reach, glm::dvec3(samples.last) + reach};
        const auto shows = [&](const SliceLayer& slice) { return meets(slice, after.grid(), box); };
        if (!scene.ray_cast && !has_walls &&
            std::none_of(scene.slices.begin(), scene.slices.end(), shows))
            continue;
        for (const View& view : views) {
            const auto seen = seen_box(view, after.grid().world_from_index, box);
            if (!seen)
                return all;
            const glm::dvec2 size(scene.size_px);
            const auto inside = [&](glm::dvec2 px) {
                return glm::uvec2(glm::clamp(px, glm::dvec2(0.0), size));
            };
            changed = united(changed, {inside(glm::floor(seen->low * size - margin_px)),
                                       inside(glm::ceil(seen->high * size + margin_px))});
        }
    }
    return changed;
}

} // namespace palpate
