#include "engine/scene/camera.h"

#include <cmath>
#include <glm/gtc/constants.hpp>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// sin and cos of an angle in degrees, exact at multiples of 90, so that quarter turns are exact.
glm::dvec2 sin_cos(double degrees) {
    const double quarter = std::round(degrees / 90.0);
    const double rest = (degrees - 90.0 * quarter) * glm::pi<double>() / 180.0;
    const double s = std::sin(rest), c = std::cos(rest);
    switch (((static_cast<int64_t>(quarter) % 4) + 4) % 4) {
        case 0:
            return {s, c};
        case 1:
            return {c, -s};
        case 2:
            return {-s, -c};
        default:
            return {-c, s};
    }
}

} // namespace

View make_view(const Camera& camera, glm::uvec2 size_px) {
    PALPATE_ASSERT(size_px.x > 0 && size_px.y > 0);
    View view;
    view.projection = camera.projection;
    view.eye_mm = camera.eye_mm;
    view.forward = glm::normalize(camera.target_mm - camera.eye_mm);
    view.right = glm::normalize(glm::cross(view.forward, camera.up));
    view.up = glm::cross(view.right, view.forward);
    const double half_height =
        camera.projection == Projection::perspective
            ? std::tan(0.5 * camera.view_angle_deg * glm::pi<double>() / 180.0)
            : 0.5 * camera.view_height_mm;
    const double half_width = half_height * camera.pixel_aspect * static_cast<double>(size_px.x) /
                              static_cast<double>(size_px.y);
    const glm::dvec2 middle = half_height * camera.shift;
    view.left = middle.x - half_width;
    view.right_edge = middle.x + half_width;
    view.bottom = middle.y - half_height;
    view.top = middle.y + half_height;
    return view;
}

std::array<View, 2> make_stereo_views(const Camera& camera, const StereoRig& rig,
                                      glm::uvec2 size_px) {
    const View middle = make_view(camera, size_px);
    std::array<View, 2> views{middle, middle};
    for (int i = 0; i < 2; ++i) {
        const double side = (i == 0 ? -0.5 : 0.5) * rig.eye_separation_mm;
        views[i].eye_mm += side * middle.right;
        // Seen from the moved eye, the window at convergence_mm lies to the other side.
        const double shift =
            camera.projection == Projection::perspective ? -side / rig.convergence_mm : -side;
        views[i].left += shift;
        views[i].right_edge += shift;
        if (camera.projection == Projection::orthographic) {
            // Parallel rays: the eye turns instead, about the centre of the convergence plane.
            const glm::dvec3 towards = rig.convergence_mm * middle.forward - side * middle.right;
            views[i].forward = glm::normalize(towards);
            views[i].right = glm::normalize(glm::cross(views[i].forward, middle.up));
            views[i].left = middle.left;
            views[i].right_edge = middle.right_edge;
        }
    }
    return views;
}

Ray ray_through(const View& view, glm::dvec2 pixel, glm::uvec2 size_px) {
    const glm::dvec2 uv = (pixel + 0.5) / glm::dvec2(size_px);
    const glm::dvec3 a = glm::mix(view.left, view.right_edge, uv.x) * view.right +
                         glm::mix(view.top, view.bottom, uv.y) * view.up;
    if (view.projection == Projection::orthographic)
        return {view.eye_mm + a, view.forward};
    return {view.eye_mm, glm::normalize(view.forward + a)};
}

Camera frame_volume(const Grid& grid, glm::dvec3 direction, glm::dvec3 up, double fill,
                    double view_angle_deg) {
    const glm::dmat3 axes(grid.world_from_index);
    const glm::dvec3 extent = glm::dvec3(grid.size) - 1.0;
    double radius = 0.0;
    for (int corner = 0; corner < 4; ++corner) // opposite corners are equally far from the centre
        radius =
            std::max(radius, 0.5 * glm::length(axes * (extent * glm::dvec3(1.0, corner & 1 ? 1 : -1,
                                                                           corner & 2 ? 1 : -1))));
    if (radius == 0.0) // one sample
        radius = 0.5 * glm::length(axes * glm::dvec3(1.0));
    radius = std::max(radius, 1e-9);
    Camera camera;
    camera.target_mm = center_mm(grid);
    const double half_angle = 0.5 * view_angle_deg * glm::pi<double>() / 180.0;
    camera.eye_mm =
        camera.target_mm + glm::normalize(direction) * (fill * radius / std::sin(half_angle));
    camera.up = up;
    camera.view_angle_deg = view_angle_deg;
    camera.view_height_mm = 2.0 * fill * radius;
    return camera;
}

Camera orbit(const Camera& camera, double degrees) {
    const glm::dvec3 axis = glm::normalize(camera.up);
    const glm::dvec2 sc = sin_cos(degrees);
    const glm::dvec3 arm = camera.eye_mm - camera.target_mm;
    Camera turned = camera;
    turned.eye_mm = camera.target_mm + arm * sc.y + glm::cross(axis, arm) * sc.x +
                    axis * (glm::dot(axis, arm) * (1.0 - sc.y));
    return turned;
}

} // namespace palpate
