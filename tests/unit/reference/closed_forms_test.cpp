// Answers that can be written down, against grid truth and the twin.

#include <gtest/gtest.h>

#include "engine/reference/truth.h"
#include "tests/unit/reference/scenes.h"

namespace palpate {
namespace {

using namespace testing_scenes;

// Grid truth is exact up to the rounding of some thousand additions of terms below 1.
constexpr double kTruth = 1e-12;

TEST(ClosedForms, SlabHidesByItsThickness) {
    const Grid grid = make_grid({9, 9, 9}, {1.0, 1.5, 2.0});
    const SceneData data{sampled(grid, [](glm::dvec3) { return 0.25; }), {}};
    const double tau = -std::log1p(-0.25);
    for (const glm::dvec3 direction :
         {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1), glm::dvec3(1, 2, 3)}) {
        Scene scene = alpha_scene(value_is_opacity(), 0.3);
        scene.camera = along(direction, center_mm(grid));
        const glm::dvec3 d = glm::abs(glm::normalize(direction));
        const glm::dvec3 chords = glm::dvec3(8.0, 12.0, 16.0) / glm::max(d, glm::dvec3(1e-300));
        const double length = std::min({chords.x, chords.y, chords.z});
        const double expected = -std::expm1(-tau * length);
        EXPECT_NEAR(truth_pixel(scene, data, {0, 0}).rgba.w, expected, kTruth);
        // The table holds tau in fp32: relative 2^-24, on a depth where d exp(-d) < 0.37. The
        // nearest of 4096 entries is 0.25 * 4095 = 1023.75 rounded to 1024: 0.25006.
        const double entry = std::round(0.25 * 4095.0) / 4095.0;
        const double table = -std::expm1(std::log1p(-entry) * length);
        EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).rgba.w, table, 3e-8);
        scene.ray_cast->integrator = Integrator::preintegrated;
        EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).rgba.w, table, 3e-8);
    }
}

TEST(ClosedForms, RampHidesByTheIntegralOfItsOpacity) {
    // Along z the value rises linearly from 0.1 to 0.9: depth = integral of -ln(1 - v) dv / slope.
    const Grid grid = make_grid({2, 2, 33}, {4.0, 4.0, 0.5});
    const double slope = 0.8 / 16.0;
    const SceneData data{
        make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) { return 0.1 + slope * 0.5 * i.z; }),
        {}};
    Scene scene = alpha_scene(value_is_opacity(), 0.01);
    scene.camera = along({0, 0, 1}, center_mm(grid));
    scene.ray_cast->transfer.opacity_unit_mm = 10.0;
    scene.ray_cast->transfer.colors = {{0.0, {0, 1, 0}}, {1.0, {1, 1, 0}}};
    const double expected = -std::expm1(-log_opacity_integral(0.1, 0.9) / slope / 10.0);
    // Red is v, seen through what lies in front: the integral of v tau T, by Simpson's rule.
    double red = 0.0;
    const int n = 200000;
    for (int i = 0; i <= n; ++i) {
        const double t = 16.0 * i / n, v = 0.1 + slope * t;
        const double through = std::exp(-log_opacity_integral(0.1, v) / slope / 10.0);
        const double weight = (i == 0 || i == n ? 1 : i % 2 == 0 ? 2 : 4) * 16.0 / n / 3.0;
        red += weight * v * -std::log1p(-v) / 10.0 * through;
    }
    const PixelSample seen = truth_pixel(scene, data, {0, 0});
    // The volume's samples are fp32: off by up to 2^-25 of value, times dtau/dv <= 1 over 16 mm.
    EXPECT_NEAR(seen.rgba.w, expected, 5e-7);
    EXPECT_NEAR(seen.rgba.x, red, 5e-7);
    EXPECT_NEAR(seen.rgba.y, seen.rgba.w, kTruth) << "green is 1 throughout";
}

TEST(ClosedForms, NarrowPeakOnAPlaneDoesNotDependOnThePhase) {
    // Opacity in a triangle 2 % of the range wide: depth = peak integral / |slope along the ray|.
    const Grid grid = make_grid({17, 17, 17}, {1, 1, 1});
    const glm::dvec3 slope(0.02, 0.03, 0.05);
    const SceneData data{sampled(grid, [&](glm::dvec3 p) { return glm::dot(slope, p); }), {}};
    const TransferFunction peak{{{0.0, glm::dvec3(1.0)}, {1.6, glm::dvec3(1.0)}},
                                {{0.79, 0.0}, {0.8, 0.5}, {0.81, 0.0}},
                                0.2};
    Scene scene = alpha_scene(peak, 1.0);
    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, 0.5, 0.9));
    // Two sides of the triangle, 0.01 of value each, opacity 0 .. 0.5.
    const double depth =
        2.0 * 0.02 * log_opacity_integral(0.0, 0.5) / glm::dot(slope, direction) / 0.2;
    const double expected = -std::expm1(-depth);
    for (double phase = 0.0; phase < 1.0; phase += 0.23) {
        scene.camera = along(direction, center_mm(grid), 60.0 + phase);
        // fp32 samples: the flanks move by 2^-24 of 0.01, and so does the slope.
        EXPECT_NEAR(truth_pixel(scene, data, {0, 0}).rgba.w, expected, 2e-5);
        // Pre-integration is exact for a linear field, up to its table, whose integral is linear
        // between entries 1.6 / 4095 apart: a share of (1.6 / 4095 / 0.01)^2 of the peak.
        scene.ray_cast->integrator = Integrator::preintegrated;
        EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).rgba.w, expected, 2e-3 * depth);
    }
}

// The same field on grids of half the spacing: the error of the grid itself falls fourfold.
template <class Value>
void expect_second_order_in_the_grid(const Value& value_on_grid, double expected) {
    const double coarse = std::abs(value_on_grid(1.0) - expected);
    const double finest = std::abs(value_on_grid(0.25) - expected);
    EXPECT_NEAR(0.5 * std::log2(coarse / finest), 2.0, 0.25) << coarse << " " << finest;
}

Grid centered_grid(double half_mm, double spacing) {
    const auto n = static_cast<uint32_t>(std::lround(2.0 * half_mm / spacing)) + 1;
    return make_grid({n, n, n}, glm::dvec3(spacing), glm::dvec3(-half_mm));
}

// A line with a given distance from the origin, in general position.
Camera passing_at(double impact_mm) {
    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.36, 0.48, 0.8));
    const glm::dvec3 side = glm::normalize(glm::dvec3(0.8, -0.6, 0.0));
    return along(direction, impact_mm * side, 60.0);
}

TEST(ClosedForms, GaussianExtinctionAtAnImpactParameter) {
    const double sigma = 3.0, tau0 = 0.2, impact = 2.0;
    const double depth = tau0 * sigma * std::sqrt(2.0 * std::acos(-1.0)) *
                         std::exp(-impact * impact / (2.0 * sigma * sigma));
    // +- 15 mm are 5 sigma: the rest of the tail is below 1e-6 of the depth.
    const auto opacity = [&](glm::dvec3 p) {
        return -std::expm1(-tau0 * std::exp(-glm::dot(p, p) / (2.0 * sigma * sigma)));
    };
    expect_second_order_in_the_grid(
        [&](double spacing) {
            const SceneData data{sampled(centered_grid(15.0, spacing), opacity), {}};
            Scene scene = alpha_scene(value_is_opacity(), 0.5);
            scene.camera = passing_at(impact);
            return -std::log1p(-truth_pixel(scene, data, {0, 0}).rgba.w);
        },
        depth);
}

TEST(ClosedForms, SphereChord) {
    const double radius = 8.0, impact = 3.0;
    const double chord = 2.0 * std::sqrt(radius * radius - impact * impact);
    const TransferFunction solid{
        {{0.0, glm::dvec3(1.0)}}, {{0.0, 0.0}, {0.0, 0.1}, {10.0, 0.1}}, 1.0};
    const auto ball = [&](glm::dvec3 p) { return radius - glm::length(p); };
    expect_second_order_in_the_grid(
        [&](double spacing) {
            const SceneData data{sampled(centered_grid(12.0, spacing), ball), {}};
            Scene scene = alpha_scene(solid, 0.5);
            scene.camera = passing_at(impact);
            return std::log1p(-truth_pixel(scene, data, {0, 0}).rgba.w) / std::log1p(-0.1);
        },
        chord);
}

TEST(ClosedForms, SphereIsMetAtItsSurface) {
    const double radius = 8.0, impact = 3.0;
    const double first = 60.0 - std::sqrt(radius * radius - impact * impact);
    const auto ball = [&](glm::dvec3 p) { return radius - glm::length(p); };
    expect_second_order_in_the_grid(
        [&](double spacing) {
            const SceneData data{sampled(centered_grid(12.0, spacing), ball), {}};
            Scene scene = alpha_scene(value_is_opacity(), 0.5);
            scene.ray_cast->mode = RayMode::iso;
            scene.ray_cast->isos = {{0.0}};
            scene.camera = passing_at(impact);
            const double truth = truth_pixel(scene, data, {0, 0}).depth;
            // Four steps of false position on a function that is nearly linear within the step.
            EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).depth, truth, 1e-4);
            return truth;
        },
        first);
}

// A ray meets nested spheres from outside in, and again on its way out: each lays its colour over
// what lies behind it.
TEST(ClosedForms, NestedSpheresAreLaidOverEachOtherInTheirOrder) {
    struct Sphere {
        double radius;
        IsoSurface surface;
    };
    const std::vector<Sphere> spheres{{9.0, {-9.0, {0.9, 0.2, 0.1}, 0.3}},
                                      {7.0, {-7.0, {0.1, 0.8, 0.3}, 0.6}},
                                      {4.0, {-4.0, {0.2, 0.3, 0.9}, 0.45}},
                                      {1.5, {-1.5, {1.0, 1.0, 0.5}, 0.8}}};
    const SceneData data{
        sampled(centered_grid(12.0, 0.25), [](glm::dvec3 p) { return -glm::length(p); }), {}};
    Scene scene = alpha_scene(value_is_opacity(), 0.1);
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->shading = Shading{1.0, 0.0, 0.0, 1.0}; // colours as given
    scene.ray_cast->min_transmittance = 0.0;
    for (const Sphere& sphere : spheres)
        scene.ray_cast->isos.push_back(sphere.surface);
    // Each ray passes all spheres well inside or well outside: linear interpolation moves a sphere
    // by 3 h^2 / (8 r) at most, 0.02 mm here.
    for (const double impact : {0.3, 1.0, 2.5, 5.5, 8.0, 10.0}) {
        std::vector<const IsoSurface*> met;
        for (const Sphere& sphere : spheres)
            if (sphere.radius > impact)
                met.push_back(&sphere.surface);
        for (size_t i = met.size(); i-- > 0;)
            met.push_back(met[i]);
        glm::dvec4 expected(0.0); // colour by opacity, and opacity; from behind
        for (size_t i = met.size(); i-- > 0;) {
            const double a = met[i]->opacity;
            expected = glm::dvec4(a * met[i]->color, a) + (1.0 - a) * expected;
        }
        scene.camera = passing_at(impact);
        for (const auto pixel : {&twin_pixel, &truth_pixel})
            EXPECT_LT(glm::length(pixel(scene, data, {0, 0}, 0).rgba - expected), 1e-9) << impact;
    }
}

TEST(ClosedForms, RadialMaximum) {
    const double sigma = 4.0, impact = 2.37;
    const auto blob = [&](glm::dvec3 p) {
        return 1000.0 * std::exp(-glm::dot(p, p) / (2.0 * sigma * sigma));
    };
    for (const double spacing : {1.0, 0.5, 0.25}) {
        const SceneData data{sampled(centered_grid(12.0, spacing), blob), {}};
        Scene scene = alpha_scene(window_function(0.0, 1000.0, 1.0), 0.5);
        scene.ray_cast->mode = RayMode::mip;
        scene.camera = passing_at(impact);
        const double truth = truth_pixel(scene, data, {0, 0}).value;
        const double twin = twin_pixel(scene, data, {0, 0}).value;
        // Linear interpolation on each axis is off by at most h^2 / 8 of the second derivative.
        const double curvature = 1000.0 / (sigma * sigma);
        EXPECT_NEAR(truth, blob({impact, 0, 0}), 3.0 * spacing * spacing / 8.0 * curvature);
        EXPECT_LE(twin, truth + 1e-9);
        // The peak lies at most half a step from a sample. There the field has fallen by at most
        // its change of slope within a cell and half a step.
        EXPECT_GE(twin, truth - curvature * (spacing + 0.25) * 0.25);
    }
}

TEST(ClosedForms, ProductOfCoordinatesIsReproducedExactly) {
    // Trilinear interpolation is exact for x y z, so truth is the integral along a cubic.
    const Grid grid = make_grid({9, 9, 9}, {1, 1, 1});
    const SceneData data{sampled(grid, [](glm::dvec3 p) { return p.x * p.y * p.z; }), {}};
    const TransferFunction transfer{
        {{0.0, {0, 0.5, 1}}, {512.0, {1, 0.5, 0}}}, {{0.0, 0.0}, {100.0, 0.02}, {512.0, 0.3}}, 1.0};
    Scene scene = alpha_scene(transfer, 0.5);
    const glm::dvec3 direction = glm::normalize(glm::dvec3(1.0, 0.7, 0.4));
    const glm::dvec3 middle(4.0, 4.0, 4.0);
    scene.camera = along(direction, middle, 50.0);
    const auto value = [&](double s) {
        const glm::dvec3 p = middle + s * direction;
        return p.x * p.y * p.z;
    };
    // Simpson's rule on either side of the knot at 100, which bisection finds.
    double low = -4.0, high = 4.0;
    for (int i = 0; i < 200; ++i)
        (value(0.5 * (low + high)) < 100.0 ? low : high) = 0.5 * (low + high);
    double depth = 0.0;
    const auto add = [&](double a, double b) {
        const int n = 20000;
        for (int i = 0; i <= n; ++i)
            depth += (i == 0 || i == n ? 1
                      : i % 2 == 0     ? 2
                                       : 4) *
                     tau_per_mm_at(transfer, value(a + (b - a) * i / n)) * (b - a) / n / 3.0;
    };
    add(-4.0 / direction.x, low);
    add(low, 4.0 / direction.x);
    EXPECT_NEAR(truth_pixel(scene, data, {0, 0}).rgba.w, -std::expm1(-depth), kTruth);

    scene.ray_cast->mode = RayMode::mip;
    EXPECT_NEAR(truth_pixel(scene, data, {0, 0}).value, value(4.0 / direction.x), 1e-9);
}

} // namespace
} // namespace palpate
