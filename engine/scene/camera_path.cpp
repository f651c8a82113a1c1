#include "engine/scene/camera_path.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// Turns the world's axes into the view's right, up and back.
glm::dquat turn_of(const Camera& camera) {
    const View view = make_view(camera, {1, 1});
    return glm::normalize(glm::quat_cast(glm::dmat3(view.right, view.up, -view.forward)));
}

double in_proportion(double a, double b, double share) {
    return a * std::pow(b / a, share);
}

} // namespace

Camera between(const Camera& a, const Camera& b, double share) {
    const glm::dmat3 axes(glm::slerp(turn_of(a), turn_of(b), share)); // the shorter way
    Camera camera = a;
    camera.target_mm = glm::mix(a.target_mm, b.target_mm, share);
    const double away_mm = in_proportion(glm::length(a.eye_mm - a.target_mm),
                                         glm::length(b.eye_mm - b.target_mm), share);
    camera.eye_mm = camera.target_mm + away_mm * axes[2];
    camera.up = axes[1];
    camera.view_angle_deg = glm::mix(a.view_angle_deg, b.view_angle_deg, share);
    camera.view_height_mm = in_proportion(a.view_height_mm, b.view_height_mm, share);
    return camera;
}

Camera along(std::span<const Camera> cameras, double share) {
    PALPATE_ASSERT(!cameras.empty());
    if (cameras.size() == 1)
        return cameras.front();
    const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(cameras.size() - 1);
    const size_t part = std::min(static_cast<size_t>(place), cameras.size() - 2);
    return between(cameras[part], cameras[part + 1], place - static_cast<double>(part));
}

} // namespace palpate
