#include "engine/render/seen_box.h"

#include <limits>

namespace palpate {

std::optional<AxisBox> box_of(const Mesh& mesh) {
    if (mesh.positions.empty())
        return std::nullopt;
    glm::vec3 low = mesh.positions.front(), high = low;
    for (const glm::vec3 position : mesh.positions) {
        low = glm::min(low, position);
        high = glm::max(high, position);
    }
    return AxisBox{glm::dvec3(low), glm::dvec3(high)};
}

std::optional<SeenBox> seen_box(const View& view, const glm::dmat4& world_from_box,
                                const AxisBox& box) {
    SeenBox seen{glm::dvec2(std::numeric_limits<double>::infinity()),
                 glm::dvec2(-std::numeric_limits<double>::infinity())};
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::dvec3 at(corner & 1 ? box.high.x : box.low.x,
                            corner & 2 ? box.high.y : box.low.y,
                            corner & 4 ? box.high.z : box.low.z);
        const glm::dvec3 arm = glm::dvec3(world_from_box * glm::dvec4(at, 1.0)) - view.eye_mm;
        const double ahead = glm::dot(arm, view.forward);
        if (!(ahead > 0.0))
            return std::nullopt;
        const double scale = view.projection == Projection::perspective ? 1.0 / ahead : 1.0;
        const glm::dvec2 on = scale * glm::dvec2(glm::dot(arm, view.right), glm::dot(arm, view.up));
        const glm::dvec2 share((on.x - view.left) / (view.right_edge - view.left),
                               (on.y - view.top) / (view.bottom - view.top));
        seen.low = glm::min(seen.low, share);
        seen.high = glm::max(seen.high, share);
    }
    return seen;
}

std::optional<PixelBox> seen_pixels_of(const View& view, const glm::dmat4& world_from_box,
                                       const AxisBox& box, glm::uvec2 size_px) {
    const std::optional<SeenBox> seen = seen_box(view, world_from_box, box);
    if (!seen)
        return std::nullopt;
    const glm::dvec2 size(size_px);
    const auto inside = [&](glm::dvec2 px) {
        return glm::uvec2(glm::clamp(px, glm::dvec2(0.0), size));
    };
    return PixelBox{inside(glm::floor(seen->low * size - 1.0)),
                    inside(glm::ceil(seen->high * size + 1.0))};
}

PixelBox pixels_of(const Scene& scene, const Mesh& mesh) {
    const std::optional<AxisBox> box = box_of(mesh);
    if (!box)
        return {};
    PixelBox all;
    for (const View& view : views_of(scene)) {
        const auto seen = seen_pixels_of(view, mesh.world_from_mesh, *box, scene.size_px);
        if (!seen)
            return {glm::uvec2(0), scene.size_px};
        all = united(all, *seen);
    }
    return all;
}

} // namespace palpate
