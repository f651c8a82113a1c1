#include "engine/scene/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

void expect_same_view(const Camera& a, const Camera& b, double tolerance) {
    const View x = make_view(a, {160, 120}), y = make_view(b, {160, 120});
    EXPECT_LE(glm::length(x.eye_mm - y.eye_mm), tolerance * 1000.0);
    EXPECT_LE(glm::length(x.right - y.right), tolerance);
    EXPECT_LE(glm::length(x.up - y.up), tolerance);
    EXPECT_NEAR(x.top, y.top, tolerance * std::abs(y.top));
}

Camera random_camera(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const auto vector = [&] { return glm::dvec3(normal(random), normal(random), normal(random)); };
    Camera camera;
    camera.target_mm = 20.0 * vector();
    camera.eye_mm = camera.target_mm + 300.0 * vector();
    camera.up = vector();
    camera.view_angle_deg = 10.0 + 50.0 * std::abs(std::sin(normal(random)));
    camera.view_height_mm = std::exp(5.0 + normal(random));
    return camera;
}

TEST(CameraPath, BeginsAndEndsAtItsCameras) {
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        const Camera cameras[] = {random_camera(random), random_camera(random),
                                  random_camera(random)};
        for (int k = 0; k < 3; ++k)
            expect_same_view(along(cameras, 0.5 * k), cameras[k], 1e-9);
        expect_same_view(along(std::span(cameras).first(1), 0.7), cameras[0], 0.0);
    }
}

// A turn about a target is gone through at an even pace.
TEST(CameraPath, OfATurnIsATurn) {
    std::mt19937 random(2);
    for (int i = 0; i < 200; ++i) {
        Camera camera = random_camera(random);
        const View view = make_view(camera, {1, 1});
        camera.up = view.up;
        const double turn = 170.0 * std::sin(0.1 * i);
        for (const double share : {0.25, 0.5, 0.9})
            expect_same_view(between(camera, orbit(camera, turn), share),
                             orbit(camera, share * turn), 1e-9);
    }
}

// An approach halves the distance in equal parts of the way.
TEST(CameraPath, ComesCloserByEqualFactors) {
    Camera from, to;
    from.eye_mm = {0, -800, 0};
    to.eye_mm = {0, -200, 0};
    EXPECT_NEAR(glm::length(between(from, to, 0.5).eye_mm), 400.0, 1e-9);
}

} // namespace
} // namespace palpate
