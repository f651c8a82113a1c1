#include "apps/view/window/slice_view.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

namespace {

// Left, posterior and superior: each the nearest of the grid's axes.
glm::dmat3 patient_axes(const Grid& grid) {
    const glm::dmat3 m(grid.world_from_index);
    std::array<glm::dvec3, 3> axes;
    for (int i = 0; i < 3; ++i)
        axes[static_cast<size_t>(i)] = glm::normalize(m[i]);
    std::array<size_t, 3> order{0, 1, 2}, best = order;
    double most = -1.0;
    do {
        double sum = 0.0;
        for (size_t i = 0; i < 3; ++i)
            sum += std::abs(axes[order[i]][static_cast<glm::length_t>(i)]);
        if (sum > most + 1e-12) {
            most = sum;
            best = order;
        }
    } while (std::next_permutation(order.begin(), order.end()));
    glm::dmat3 found;
    for (size_t i = 0; i < 3; ++i) {
        const auto at = static_cast<glm::length_t>(i);
        found[at] = axes[best[i]][at] < 0 ? -axes[best[i]] : axes[best[i]];
    }
    found[2] = glm::normalize(glm::cross(found[0], found[1]));
    found[1] = glm::cross(found[2], found[0]);
    return found;
}

// Half the volume's extent along a direction.
double half_extent(const Grid& grid, glm::dvec3 direction) {
    double half = 0.0;
    const glm::dmat3 m(grid.world_from_index);
    for (int i = 0; i < 3; ++i) // of the samples with half of one to each side
        half += 0.5 * grid.size[i] * std::abs(glm::dot(m[i], direction));
    return half;
}

constexpr double kRoom = 1.04; // about the volume

} // namespace

std::array<SliceView, kSlicePanels> slice_views(const Grid& grid) {
    const glm::dmat3 axes = patient_axes(grid);
    const glm::dvec3 left = axes[0], posterior = axes[1], superior = axes[2];
    const glm::dvec3 center = center_mm(grid);
    return {SliceView{left, -posterior, -superior, center, 1.0},
            SliceView{left, superior, -posterior, center, 1.0},
            SliceView{posterior, superior, left, center, 1.0}};
}

glm::dvec3 point_of_plane(const SliceView& view, glm::dvec3 crosshair_mm) {
    constexpr double kSteps_per_mm = 1 << 30;
    const double depth_mm = glm::dot(crosshair_mm - view.center_mm, view.towards);
    return view.center_mm + std::round(depth_mm * kSteps_per_mm) / kSteps_per_mm * view.towards;
}

Camera camera_of(const SliceView& view, glm::dvec3 crosshair_mm, const Grid& grid,
                 glm::ivec2 size_px) {
    const double reach =
        1.0 + glm::length(glm::dvec3(half_extent(grid, {1, 0, 0}), half_extent(grid, {0, 1, 0}),
                                     half_extent(grid, {0, 0, 1})));
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.target_mm = point_of_plane(view, crosshair_mm);
    camera.eye_mm = camera.target_mm + 2.0 * reach * view.towards;
    camera.up = view.up;
    camera.view_height_mm = mm_per_px(view, grid, size_px) * std::max(size_px.y, 1);
    return camera;
}

double mm_per_px(const SliceView& view, const Grid& grid, glm::ivec2 size_px) {
    const glm::dvec2 room = glm::max(glm::dvec2(size_px), 1.0);
    return 2.0 * kRoom / view.zoom *
           std::max(half_extent(grid, view.right) / room.x, half_extent(grid, view.up) / room.y);
}

glm::dvec3 point_under(const SliceView& view, glm::dvec3 crosshair_mm, const Grid& grid,
                       glm::ivec2 size_px, glm::dvec2 pixel) {
    const glm::dvec2 off =
        (pixel + 0.5 - 0.5 * glm::dvec2(size_px)) * mm_per_px(view, grid, size_px);
    return point_of_plane(view, crosshair_mm) + off.x * view.right - off.y * view.up;
}

glm::dvec2 pixel_of(const SliceView& view, const Grid& grid, glm::ivec2 size_px,
                    glm::dvec3 point_mm) {
    const glm::dvec3 arm = point_mm - view.center_mm;
    return 0.5 * glm::dvec2(size_px) - 0.5 +
           glm::dvec2(glm::dot(arm, view.right), -glm::dot(arm, view.up)) /
               mm_per_px(view, grid, size_px);
}

std::optional<glm::dvec2> pixel_of(const Camera& camera, glm::ivec2 size_px, glm::dvec3 point_mm) {
    return pixel_of(make_view(camera, glm::uvec2(glm::max(size_px, 1))), size_px, point_mm);
}

std::optional<glm::dvec2> pixel_of(const View& view, glm::ivec2 size_px, glm::dvec3 point_mm) {
    const glm::dvec3 arm = point_mm - view.eye_mm;
    const double ahead = glm::dot(arm, view.forward);
    if (!(ahead > 0.0))
        return std::nullopt;
    const double scale = view.projection == Projection::perspective ? 1.0 / ahead : 1.0;
    const glm::dvec2 at = scale * glm::dvec2(glm::dot(arm, view.right), glm::dot(arm, view.up));
    return glm::dvec2((at.x - view.left) / (view.right_edge - view.left),
                      (at.y - view.top) / (view.bottom - view.top)) *
               glm::dvec2(size_px) -
           0.5;
}

double layer_step_mm(const Grid& grid, glm::dvec3 direction) {
    const glm::dvec3 samples = glm::abs(glm::dmat3(index_from_world(grid)) * direction);
    return 1.0 / std::max({samples.x, samples.y, samples.z});
}

std::string patient_text(glm::dvec3 point_mm) {
    constexpr std::pair<char, char> kSides[] = {{'L', 'R'}, {'P', 'A'}, {'S', 'I'}};
    std::string text;
    for (int axis = 0; axis < 3; ++axis) {
        const double tenths = std::round(10.0 * point_mm[axis]); // no "R 0.0"
        const auto [positive, negative] = kSides[axis];
        text += fmt::format("{} {:.1f}{}", tenths < 0.0 ? negative : positive,
                            std::abs(tenths) / 10.0, axis < 2 ? "  " : " mm");
    }
    return text;
}

} // namespace palpate::view
