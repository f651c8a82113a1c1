#include "apps/view/window/camera_moves.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace palpate::view {

glm::dvec3 turned(glm::dvec3 v, glm::dvec3 axis, double radians) {
    return glm::dmat3(glm::rotate(glm::dmat4(1.0), radians, axis)) * v;
}

void rotate(Camera& camera, glm::dvec2 by_px, glm::dvec2 size_px) {
    const View view = make_view(camera, glm::uvec2(1));
    const double per_px = M_PI / std::max(1.0, std::min(size_px.x, size_px.y));
    glm::dvec3 arm = camera.eye_mm - camera.target_mm, up = view.up;
    arm = turned(arm, view.up, -by_px.x * per_px);
    const glm::dvec3 right = turned(view.right, view.up, -by_px.x * per_px);
    arm = turned(arm, right, -by_px.y * per_px);
    up = turned(up, right, -by_px.y * per_px);
    camera.eye_mm = camera.target_mm + arm;
    camera.up = up;
}

void roll(Camera& camera, glm::dvec2 from_px, glm::dvec2 to_px) {
    if (glm::length(from_px) < 1.0 || glm::length(to_px) < 1.0)
        return;
    const double angle = std::atan2(to_px.y, to_px.x) - std::atan2(from_px.y, from_px.x);
    const View view = make_view(camera, glm::uvec2(1));
    camera.up = turned(view.up, view.forward, -angle);
}

void pan(Camera& camera, glm::dvec2 by_px, glm::dvec2 size_px) {
    const View view = make_view(camera, glm::uvec2(1));
    const double distance = glm::length(camera.target_mm - camera.eye_mm);
    const double height = camera.projection == Projection::orthographic ? camera.view_height_mm
                                                                        : 2.0 * distance * view.top;
    const double per_px = height / std::max(1.0, size_px.y);
    const glm::dvec3 by = per_px * (-by_px.x * view.right + by_px.y * view.up);
    camera.eye_mm += by;
    camera.target_mm += by;
}

void zoom(Camera& camera, double times, double extent_mm) {
    camera.view_height_mm = std::clamp(camera.view_height_mm / times, 1e-3, 1e6);
    const glm::dvec3 arm = camera.eye_mm - camera.target_mm;
    const double now = glm::length(arm);
    const double next = std::clamp(now / times, 1e-3 * extent_mm, 100.0 * extent_mm);
    camera.eye_mm = camera.target_mm + arm * (next / now);
}

} // namespace palpate::view
