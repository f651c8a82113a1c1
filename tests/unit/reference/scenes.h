#pragma once

#include <cmath>
#include <functional>

#include "engine/scene/scene.h"
#include "engine/volume/builder.h"

// Small volumes and cameras that the tests of the reference share.
namespace palpate::testing_scenes {

// A volume of a function of world millimetres.
inline Volume sampled(const Grid& grid, const std::function<double(glm::dvec3)>& field) {
    return make_volume(grid, ScalarType::f32, [&](glm::uvec3 index) {
        return field(world_point(grid, glm::dvec3(index)));
    });
}

// Looks along `direction` at `target` with parallel rays, a pixel being a millimetre: for a picture
// of one pixel, pixel (0, 0) is the ray through the target.
inline Camera along(glm::dvec3 direction, glm::dvec3 target, double distance_mm = 100.0) {
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.target_mm = target;
    camera.eye_mm = target - distance_mm * glm::normalize(direction);
    camera.up =
        std::abs(glm::normalize(direction).z) > 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
    camera.view_height_mm = 1.0;
    return camera;
}

inline Scene alpha_scene(const TransferFunction& transfer, double step_mm) {
    Scene scene;
    scene.size_px = {1, 1};
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->transfer = transfer;
    scene.ray_cast->step_mm = step_mm;
    scene.ray_cast->min_transmittance = 0.0;
    return scene;
}

// White, with the opacity of the value itself: tau(v) = -ln(1 - v) per mm on 0 .. 1.
inline TransferFunction value_is_opacity() {
    return {{{0.0, glm::dvec3(1.0)}}, {{0.0, 0.0}, {1.0, 1.0}}, 1.0};
}

// The integral of -ln(1 - o) over o from a to b.
inline double log_opacity_integral(double a, double b) {
    const auto primitive = [](double o) { return (1.0 - o) * (std::log1p(-o) - 1.0); };
    return primitive(b) - primitive(a);
}

} // namespace palpate::testing_scenes
