#include "engine/render/changed_pixels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/render/targets.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace {

// In samples: of cubic interpolation, and of differences between neighbours that are interpolated.
constexpr double kReach = 2.0;

struct IndexBox {
    glm::dvec3 low, high;
    glm::dvec3 corner(uint32_t number) const {
        return {number & 1 ? high.x : low.x, number & 2 ? high.y : low.y,
                number & 4 ? high.z : low.z};
    }
};

bool meets(const SliceLayer& slice, const Grid& grid, const IndexBox& box) {
    const glm::dvec3 normal = glm::normalize(slice.normal);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const double at = glm::dot(normal, world_point(grid, box.corner(corner)) - slice.point_mm);
        low = std::min(low, at);
        high = std::max(high, at);
    }
    return low <= 0.5 * slice.slab_mm && high >= -0.5 * slice.slab_mm;
}

// About the picture of a box; nothing where a part of it is not in front of the eye.
std::optional<std::pair<glm::dvec2, glm::dvec2>> seen(const View& view, const Grid& grid,
                                                      const IndexBox& box) {
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::dvec3 arm = world_point(grid, box.corner(corner)) - view.eye_mm;
        const double ahead = glm::dot(arm, view.forward);
        if (!(ahead > 0.0))
            return std::nullopt;
        const double scale = view.projection == Projection::perspective ? 1.0 / ahead : 1.0;
        const glm::dvec2 at = scale * glm::dvec2(glm::dot(arm, view.right), glm::dot(arm, view.up));
        const glm::dvec2 share((at.x - view.left) / (view.right_edge - view.left),
                               (at.y - view.top) / (view.bottom - view.top));
        low = glm::min(low, share);
        high = glm::max(high, share);
    }
    return std::pair(low, high);
}

} // namespace

PixelBox united(const PixelBox& a, const PixelBox& b) {
    if (a.empty() || b.empty())
        return a.empty() ? b : a;
    return {glm::min(a.low, b.low), glm::max(a.high, b.high)};
}

PixelBox changed_pixels(const Scene& scene, const Volume& before, const Volume& after) {
    const PixelBox all{glm::uvec2(0), scene.size_px};
    if (before.is_same_as(after))
        return {};
    if (before.grid() != after.grid() || before.type() != after.type() || !scene.surfaces.empty())
        return all;
    // Of labels, outlines look so far; and a pixel beyond for rounding.
    const double outline_px = std::max(scene.labels ? double(scene.labels->outline_px) : 0.0, 0.0);
    const glm::dvec2 margin_px(std::ceil(outline_px) + 1.0);
    const std::vector<View> views = views_of(scene);
    PixelBox changed;
    for (const ChangedBrick& brick : changed_bricks(before, after)) {
        const auto [low, high] = changed_samples(brick);
        const glm::dvec3 first(brick.position * kBrickSide);
        const IndexBox box{first + glm::dvec3(low) - kReach,
                           first + glm::dvec3(high) - 1.0 + kReach};
        const auto shows = [&](const SliceLayer& slice) { return meets(slice, after.grid(), box); };
        if (!scene.ray_cast && std::none_of(scene.slices.begin(), scene.slices.end(), shows))
            continue;
        for (const View& view : views) {
            const auto shares = seen(view, after.grid(), box);
            if (!shares)
                return all;
            const glm::dvec2 size(scene.size_px);
            const auto inside = [&](glm::dvec2 px) {
                return glm::uvec2(glm::clamp(px, glm::dvec2(0.0), size));
            };
            changed = united(changed, {inside(glm::floor(shares->first * size - margin_px)),
                                       inside(glm::ceil(shares->second * size + margin_px))});
        }
    }
    return changed;
}

} // namespace palpate
