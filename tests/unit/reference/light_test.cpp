// Lights apart from the eye, and ambient occlusion, of the twin in double.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/reference/sampler.h"
#include "engine/reference/twin.h"
#include "engine/volume/builder.h"

namespace palpate {
namespace {

using reference::LocalRay;
using reference::Rays;
using reference::Sampler;

// A floor z <= 0 with walls x <= 0 and y <= 0 of material, as many as `planes` says: values are
// mm into the material, so that the surface lies at 0 and the slope is 1 but along the edges.
constexpr double kSpacing_mm = 0.25;

Volume corner(int planes) {
    const Grid grid = make_grid({97, 97, 97}, glm::dvec3(kSpacing_mm), glm::dvec3(-4.0));
    return make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        double value = -p.z;
        for (int wall = 0; wall < planes - 1; ++wall)
            value = std::max(value, -p[wall]);
        return value;
    });
}

// How open the floor is at (x, y, 0), seen from above.
double openness_at(const SceneData& data, double x, double y, double radius_mm,
                   std::vector<ClipPlane> clips = {}) {
    Scene scene;
    scene.size_px = {1, 1};
    scene.camera = {Projection::orthographic, {x, y, 15.0}, {x, y, 0.0}, {0, 1, 0}};
    scene.camera.view_height_mm = 1.0;
    scene.clip_planes = std::move(clips);
    scene.ray_cast = RayCastLayer{.mode = RayMode::iso, .isos = {{0.0}}};
    scene.ray_cast->occlusion_mm = radius_mm;
    const Rays rays(scene, data, 0);
    Sampler sampler(scene, data, rays);
    return sampler.openness(rays.through({0.0, 0.0}), 15.0, 0.0);
}

// The corners of a truncated cuboctahedron above the floor: all orders and signs of
// (1, 1 + sqrt 2, 1 + 2 sqrt 2).
std::vector<glm::dvec3> directions() {
    std::array<double, 3> c{1.0, 1.0 + std::sqrt(2.0), 1.0 + std::sqrt(8.0)};
    std::vector<glm::dvec3> all;
    do
        for (int signs = 0; signs < 4; ++signs)
            all.push_back(glm::normalize(
                glm::dvec3(signs & 1 ? -c[0] : c[0], signs & 2 ? -c[1] : c[1], c[2])));
    while (std::next_permutation(c.begin(), c.end()));
    return all;
}

// The corner's openness by the definition: a place at t along d is distance + d t from a wall.
double expected_openness(int planes, glm::dvec2 from_walls, double radius_mm) {
    const double fall = radius_mm / 16.0;
    double sum = 0.0, weights = 0.0;
    for (const glm::dvec3 d : directions()) {
        double mean = 0.0;
        for (int k = 0; k < 8; ++k) {
            const double t = (k + 0.5) * radius_mm / 8.0;
            double free = 1.0; // walls recede or come nearer all the way: the last place decides
            for (int wall = 0; wall < planes - 1; ++wall)
                free =
                    std::min(free, std::clamp((from_walls[wall] + d[wall] * t) / fall, 0.0, 1.0));
            mean += free / 8.0;
        }
        sum += d.z * mean;
        weights += d.z;
    }
    return sum / weights;
}

TEST(AmbientOcclusion, APlaneIsOpen) {
    const SceneData data{corner(1), std::nullopt};
    for (const double radius_mm : {0.5, 2.0, 8.0, 30.0}) // the last goes beyond the volume
        EXPECT_NEAR(openness_at(data, 3.1, 4.3, radius_mm), 1.0, 1e-12) << radius_mm;
}

// In cells that the edge between two planes cuts, the interpolant of the maximum of two linear
// functions is off by at most a quarter of the spacing; a place then by that over the fall. Where
// the point lies e from its walls, directions of cosine c to a wall are free for e / c of the
// radius, at least their first place: so much is the corner more open than 1/2 and 1/4.
TEST(AmbientOcclusion, ACornerOfTwoPlanesIsHalfOpenAndOfThreeAQuarter) {
    const double radius_mm = 12.0, off = 0.25 * kSpacing_mm / (radius_mm / 16.0);
    for (const int planes : {2, 3}) {
        const SceneData data{corner(planes), std::nullopt};
        for (const double e : {0.75, 1.5, 4.0}) {
            const double found = openness_at(data, e, e, radius_mm);
            EXPECT_NEAR(found, expected_openness(planes, glm::dvec2(e), radius_mm), off)
                << planes << " " << e;
        }
        // In the limit: each direction towards a wall is free for e / (c radius) and one place.
        const double e = 3.0 * kSpacing_mm, limit = planes == 2 ? 0.5 : 0.25;
        double more = 0.0, weights = 0.0;
        for (const glm::dvec3 d : directions()) {
            const double towards = std::max(-d.x, planes == 3 ? -d.y : -1.0);
            weights += d.z;
            if (towards > 0.0)
                more += d.z * std::min(1.0, (e / towards) / radius_mm + 1.0 / 8.0);
        }
        const double found = openness_at(data, e, e, radius_mm);
        EXPECT_GT(found, limit);
        EXPECT_LT(found, limit + more / weights + off);
    }
}

// Every place at a corner of planes is a function of distance by radius that rises.
TEST(AmbientOcclusion, ALargerRadiusOpensNothing) {
    const SceneData data{corner(3), std::nullopt};
    double before = 1.0;
    for (const double radius_mm : {0.5, 1.0, 2.0, 4.0, 8.0, 12.0}) {
        const double now = openness_at(data, 1.5, 2.5, radius_mm);
        EXPECT_LE(now, before + 1e-12) << radius_mm;
        before = now;
    }
    EXPECT_LT(before, 0.6);
}

TEST(AmbientOcclusion, WhatIsClippedHidesNothing) {
    const SceneData data{corner(2), std::nullopt};
    // A sixteenth of the radius before it places begin to be hidden, and that far behind the plane
    // they are wholly cut away.
    const ClipPlane without_wall{{1.0, 0, 0}, {1, 0, 0}};
    EXPECT_LT(openness_at(data, 1.5, 5.0, 8.0), 0.75);
    EXPECT_NEAR(openness_at(data, 1.5, 5.0, 8.0, {without_wall}), 1.0, 1e-12);
}

// The camera looks towards posterior, up is superior: right is the patient's left.
TEST(Light, ItsAnglesAreTheCameras) {
    const Camera camera{Projection::orthographic, {0, -100, 0}, {0, 0, 0}, {0, 0, 1}};
    const auto expect = [&](Light light, glm::dvec3 expected) {
        EXPECT_NEAR(glm::distance(towards(light, camera), expected), 0.0, 1e-15);
    };
    expect({0, 0}, {0, -1, 0});
    expect({90, 0}, {1, 0, 0});
    expect({-90, 0}, {-1, 0, 0});
    expect({0, 90}, {0, 0, 1});
    expect({180, 0}, {0, 1, 0});
}

// A sphere under a light: Blinn and Phong's terms by hand at points whose normal is known.
TEST(Light, ASphereIsLitByTheFormula) {
    const Grid grid = make_grid({81, 81, 81}, glm::dvec3(0.5), glm::dvec3(-20.0));
    const SceneData data{
        make_volume(grid, ScalarType::f32,
                    [&](glm::uvec3 i) { return -glm::length(world_point(grid, glm::dvec3(i))); }),
        std::nullopt};
    Scene scene;
    scene.size_px = {41, 41};
    scene.camera = {Projection::orthographic, {0, -100, 0}, {0, 0, 0}, {0, 0, 1}};
    scene.camera.view_height_mm = 20.5; // pixels of half a millimetre
    scene.ray_cast = RayCastLayer{.mode = RayMode::iso, .isos = {{-15.0, {0.8, 0.6, 0.4}}}};
    scene.ray_cast->light = Light{60.0, 20.0};
    const glm::dvec3 light = towards(*scene.ray_cast->light, scene.camera);
    // The distance is interpolated within h^2 / (8 r) in each of three axes, differences of it over
    // 2 h by its third derivative, 3 / r^2 at most, h^2 / 6 of it: an angle, as the slope is 1. The
    // interpolated difference adds the error of the distance twice over 2 h.
    const double h = 0.5, r = 14.0,
                 angle = 2.0 * 3.0 * h * h / (8.0 * r) / (2.0 * h) * 3.0 +
                         h * h / 6.0 * 3.0 / (r * r) * 3.0;
    const Shading shading;
    const double bound = (shading.diffuse + shading.specular * (8.0 + shading.shininess)) * angle;
    const Image picture = render_twin(scene, data);
    size_t lit = 0, dark = 0;
    for (uint32_t y = 0; y < 41; ++y)
        for (uint32_t x = 0; x < 41; ++x) {
            const double right = 0.5 * (double(x) - 20.0), up = 0.5 * (20.0 - double(y));
            const double across = right * right + up * up;
            const glm::dvec3 n = glm::dvec3(right, -std::sqrt(225.0 - across), up) / 15.0;
            const double nl = glm::dot(n, light);
            const glm::dvec3 half = glm::normalize(light + glm::dvec3(0, -1, 0));
            const double highlight = 0.15 * std::clamp(8.0 * nl, 0.0, 1.0) *
                                     std::pow(std::max(glm::dot(n, half), 0.0), 10.0);
            const double red = 0.8 * (0.2 + 0.65 * std::max(nl, 0.0)) + highlight;
            ASSERT_NEAR(picture.at(x, y, 0), red, bound) << x << " " << y;
            lit += nl > 0.2;
            dark += nl < -0.05;
        }
    EXPECT_GT(lit, 500u);
    EXPECT_GT(dark, 20u); // ambient alone
}

// From straight ahead it is the light at the eye, where rays are parallel: highlights fade in below
// a cosine of 1/8 alone, where they are below 0.15 / 8^10.
TEST(Light, FromTheViewDirectionIsTheLightAtTheEye) {
    const SceneData data{corner(3), std::nullopt};
    Scene scene;
    scene.size_px = {24, 24};
    scene.camera = {Projection::orthographic, {18, 14, 16}, {5, 5, 2}, {0, 0, 1}};
    scene.camera.view_height_mm = 12.0;
    scene.ray_cast = RayCastLayer{.mode = RayMode::iso, .isos = {{0.0}}};
    const Image eye = render_twin(scene, data);
    scene.ray_cast->light = Light{};
    const Image light = render_twin(scene, data);
    for (uint32_t y = 0; y < 24; ++y)
        for (uint32_t x = 0; x < 24; ++x)
            ASSERT_NEAR(eye.at(x, y, 0), light.at(x, y, 0), 1e-6);
}

} // namespace
} // namespace palpate
