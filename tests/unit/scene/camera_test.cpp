#include "engine/scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

double distance(glm::dvec3 a, glm::dvec3 b) {
    return glm::length(a - b);
}

// The pixel in which a world point lands, by solving ray_through for it.
glm::dvec2 pixel_of(const View& view, glm::dvec3 point, glm::uvec2 size_px) {
    const glm::dvec3 to = point - view.eye_mm;
    const double depth =
        view.projection == Projection::perspective ? glm::dot(to, view.forward) : 1.0;
    const double a = glm::dot(to, view.right) / depth, b = glm::dot(to, view.up) / depth;
    return {(a - view.left) / (view.right_edge - view.left) * size_px.x - 0.5,
            (b - view.top) / (view.bottom - view.top) * size_px.y - 0.5};
}

TEST(Camera, MiddleOfThePictureLooksAtTheTarget) {
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera camera;
        camera.projection = projection;
        camera.eye_mm = {10, -300, 40};
        camera.target_mm = {1, 2, 3};
        const Ray ray = ray_through(make_view(camera, {101, 51}), {50, 25}, {101, 51});
        const double along = glm::dot(camera.target_mm - ray.origin_mm, ray.direction);
        EXPECT_LT(distance(ray.origin_mm + along * ray.direction, camera.target_mm), 1e-10);
        EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-15);
    }
}

TEST(Camera, FirstPixelIsTopLeft) {
    Camera camera; // looks along +y, up is +z, so right is +x
    const View view = make_view(camera, {4, 4});
    const Ray ray = ray_through(view, {0, 0}, {4, 4});
    EXPECT_LT(ray.direction.x, 0.0);
    EXPECT_GT(ray.direction.z, 0.0);
    const double edge = std::tan(15.0 * std::acos(-1.0) / 180.0);
    EXPECT_NEAR(ray.direction.x / ray.direction.y, -0.75 * edge, 1e-14);
}

TEST(Camera, StereoEyesAgreeAtTheConvergenceDistance) {
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera camera;
        camera.projection = projection;
        const StereoRig rig{60.0, 400.0};
        const glm::uvec2 size{64, 64};
        const View middle = make_view(camera, size);
        const auto views = make_stereo_views(camera, rig, size);
        const glm::dvec3 point = camera.eye_mm + rig.convergence_mm * middle.forward;
        const glm::dvec2 left = pixel_of(views[0], point, size);
        const glm::dvec2 right = pixel_of(views[1], point, size);
        EXPECT_NEAR(left.x, right.x, 1e-9);
        EXPECT_NEAR(left.y, right.y, 1e-9);
        // A nearer point lies further right for the left eye.
        const glm::dvec3 near = camera.eye_mm + 0.5 * rig.convergence_mm * middle.forward;
        EXPECT_GT(pixel_of(views[0], near, size).x, pixel_of(views[1], near, size).x + 1.0);
        EXPECT_GT(glm::dot(views[1].eye_mm - views[0].eye_mm, middle.right), 59.9);
    }
}

TEST(Camera, FourQuarterTurnsComeBackToTheBit) {
    Camera camera;
    camera.eye_mm = {10, -300, 40};
    Camera turned = camera;
    turned = orbit(turned, 90.0);
    EXPECT_NEAR(turned.eye_mm.x, 300.0, 1e-9) << "counter-clockwise about +z";
    EXPECT_EQ(orbit(camera, 360.0).eye_mm, camera.eye_mm);
}

TEST(Camera, FramingTouchesTheSphereRoundTheBox) {
    const Grid grid = make_grid({101, 101, 51}, {1, 1, 2}, {5, 6, 7});
    const Camera camera = frame_volume(grid, {0, -1, 0}, {0, 0, 1}, 1.0);
    EXPECT_EQ(camera.target_mm, glm::dvec3(55, 56, 57));
    const double radius = 0.5 * std::sqrt(3.0) * 100.0;
    EXPECT_NEAR(distance(camera.eye_mm, camera.target_mm),
                radius / std::sin(15.0 * std::acos(-1.0) / 180.0), 1e-9);
}

} // namespace
} // namespace palpate
