// Halving the step must divide the error by what the rule promises (Etiene et al., TVCG 2014).

#include <gtest/gtest.h>

#include "engine/reference/truth.h"
#include "tests/unit/reference/scenes.h"

namespace palpate {
namespace {

using namespace testing_scenes;

double rmse(const Image& a, const Image& b) {
    double sum = 0.0;
    for (size_t i = 0; i < a.samples.size(); ++i)
        sum += (a.samples[i] - b.samples[i]) * (a.samples[i] - b.samples[i]);
    return std::sqrt(sum / static_cast<double>(a.samples.size()));
}

// The test signal of Marschner and Lobb (Visualization 1994) seen obliquely.
std::pair<Scene, SceneData> marschner_lobb() {
    const Grid grid = make_grid({41, 41, 41}, glm::dvec3(0.05), glm::dvec3(-1.0));
    const double pi = std::acos(-1.0);
    const auto signal = [pi](glm::dvec3 p) {
        const double r = std::hypot(p.x, p.y), alpha = 0.25, frequency = 6.0;
        const double rho = std::cos(2.0 * pi * frequency * std::cos(0.5 * pi * r));
        return (1.0 - std::sin(0.5 * pi * p.z) + alpha * (1.0 + rho)) / (2.0 * (1.0 + alpha));
    };
    TransferFunction transfer{{{0.0, {0, 0.3, 1}}, {1.0, {1, 0.6, 0}}}, {}, 0.05};
    for (int i = 0; i <= 16; ++i) // smooth in value: a squared sine, in many points
        transfer.opacities.push_back({i / 16.0, 0.1 * std::pow(std::sin(pi * i / 16.0), 2)});
    Scene scene = alpha_scene(transfer, 0.05);
    scene.size_px = {24, 24};
    scene.camera = frame_volume(grid, {0.5, -1.0, 0.3}, {0, 0, 1}, 0.6);
    return {scene, SceneData{sampled(grid, signal), {}}};
}

double order_of(Integrator integrator) {
    auto [scene, data] = marschner_lobb();
    const Image truth = render_truth(scene, data);
    scene.ray_cast->integrator = integrator;
    std::vector<double> errors;
    // 1/2, 1/4 and 1/8 voxel. Below that the 4096 entries of the table show: 5e-6 here, which a
    // table of 2^18 entries removes.
    for (const double step : {0.025, 0.0125, 0.00625}) {
        scene.ray_cast->step_mm = step;
        errors.push_back(rmse(render_twin(scene, data), truth));
    }
    return 0.5 * std::log2(errors.front() / errors.back());
}

TEST(Convergence, MidpointIsOfSecondOrder) {
    EXPECT_NEAR(order_of(Integrator::fast), 2.0, 0.2);
}

TEST(Convergence, PreintegrationIsOfSecondOrder) {
    EXPECT_NEAR(order_of(Integrator::preintegrated), 2.0, 0.2);
}

// The smoothest table that 4096 entries hold: a squared sine in many points. Sub-steps 2, 4 and 8
// of a cell; below that the table shows.
TEST(Convergence, ExactIsOfThirdOrderInItsSubSteps) {
    auto [scene, data] = marschner_lobb();
    const double pi = std::acos(-1.0);
    scene.ray_cast->transfer.opacities.clear();
    for (int i = 0; i <= 256; ++i)
        scene.ray_cast->transfer.opacities.push_back(
            {i / 256.0, 0.1 * std::pow(std::sin(pi * i / 256.0), 2)});
    scene.ray_cast->integrator = Integrator::exact;
    const Image truth = render_truth(scene, data);
    std::vector<double> errors;
    for (const uint32_t sub_steps : {2u, 4u, 8u}) {
        scene.ray_cast->sub_steps = sub_steps;
        errors.push_back(rmse(render_twin(scene, data), truth));
    }
    EXPECT_GE(0.5 * std::log2(errors.front() / errors.back()), 2.7);
    EXPECT_LT(errors.back(), 1e-5);
}

// A peak whose feet are 2 % of the range apart.
TEST(Convergence, ExactResolvesANarrowPeak) {
    auto [scene, data] = marschner_lobb();
    scene.ray_cast->transfer.opacities = {
        {0.0, 0.0}, {0.49, 0.0}, {0.5, 0.9}, {0.51, 0.0}, {1.0, 0.0}};
    const Image truth = render_truth(scene, data);
    const double midpoint = rmse(render_twin(scene, data), truth); // one sample a voxel
    scene.ray_cast->integrator = Integrator::exact;
    std::vector<double> errors;
    for (const uint32_t sub_steps : {2u, 4u, 8u}) {
        scene.ray_cast->sub_steps = sub_steps;
        errors.push_back(rmse(render_twin(scene, data), truth));
    }
    EXPECT_GE(0.5 * std::log2(errors.front() / errors.back()), 2.0);
    EXPECT_LE(errors.back(), 5e-4);
    EXPECT_GE(midpoint / errors.back(), 100.0);
}

// A single cell across which the value rises from 0 to 1000, seen along that axis.
std::pair<Scene, SceneData> one_cell(const TransferFunction& transfer, double spacing_mm) {
    const Grid grid = make_grid({2, 2, 2}, glm::dvec3(spacing_mm), glm::dvec3(0.0));
    Scene scene = alpha_scene(transfer, spacing_mm);
    scene.ray_cast->integrator = Integrator::exact;
    scene.camera = frame_volume(grid, {1, 0, 0}, {0, 0, 1}, 0.3);
    scene.camera.projection = Projection::orthographic;
    return {scene,
            SceneData{sampled(grid, [&](glm::dvec3 p) { return 1000.0 * p.x / spacing_mm; }), {}}};
}

// Colour changes while matter hides it: the front of a piece hides its back. The constant opacity
// has a closed form: with tau per mm and colour linear along L mm from c_a to c_b, the light is
// c_a (1 - e^-d) + (c_b - c_a) (1 - e^-d (1 + d)) / d with d = tau L.
TEST(Convergence, ExactMixesTheColoursOfDenseMatter) {
    for (const double spacing_mm : {0.1, 1.0, 3.0, 10.0})
        for (const double opacity : {0.05, 0.5, 0.9, 0.99, 0.9999}) {
            auto [scene, data] = one_cell(
                {{{0, {1, 0, 0.5}}, {1000, {0, 1, 0.5}}}, {{0, opacity}, {1000, opacity}}, 1.0},
                spacing_mm);
            const double depth = -std::log1p(-opacity) * spacing_mm;
            const bool rising = scene.camera.eye_mm.x < spacing_mm;
            const double hidden = -std::expm1(-depth);
            const double behind =
                (1.0 - std::exp(-depth) * (1.0 + depth)) / depth; // of the far end
            for (const uint32_t sub_steps : {1u, 8u, 64u}) {
                scene.ray_cast->sub_steps = sub_steps;
                const glm::dvec4 seen = twin_pixel(scene, data, {0, 0}).rgba;
                const double green = rising ? behind : hidden - behind;
                // One step of the table, a sub-step's error times their number, what is left out
                // behind, and what the table's entries in fp32 are off by.
                const double steps = 4.0 + std::min(depth, 14.0);
                const double bound = 1.0 / 4095.0 + steps * span_tolerance(sub_steps) + 0x1p-20;
                EXPECT_NEAR(seen.y, green, bound)
                    << spacing_mm << " " << opacity << " " << sub_steps;
                EXPECT_NEAR(seen.x, hidden - green, bound);
                EXPECT_NEAR(seen.z, 0.5 * hidden, bound);
                EXPECT_NEAR(seen.w, hidden, 2e-6);
            }
        }
}

// Opacities that change, with kinks and steps, in cells of 3 and 10 mm.
TEST(Convergence, ExactResolvesDenseMatterOfAnyTransferFunction) {
    const std::vector<TransferFunction::ColorPoint> colors{{0, {1, 0, 0}}, {1000, {0, 1, 0}}};
    const std::vector<TransferFunction> functions{
        {colors, {{0, 0.0}, {1000, 0.99}}, 1.0},
        {colors, {{0, 0.99}, {1000, 0.0}}, 1.0},
        {colors, {{0, 0.0}, {300, 0.0}, {310, 0.99}, {320, 0.0}, {1000, 0.9}}, 1.0},
        {{{0, {1, 1, 0}}, {500, {1, 0, 0}}, {500, {0, 0, 1}}, {1000, {0, 1, 1}}},
         {{0, 0.3}, {600, 0.3}, {600, 0.999}, {1000, 0.999}},
         1.0}};
    for (const TransferFunction& function : functions)
        for (const double spacing_mm : {3.0, 10.0}) {
            auto [scene, data] = one_cell(function, spacing_mm);
            for (const bool back : {false, true}) {
                if (back)
                    scene.camera = orbit(scene.camera, 180.0);
                const glm::dvec4 truth = truth_pixel(scene, data, {0, 0}).rgba;
                for (const uint32_t sub_steps : {2u, 8u, 32u}) {
                    scene.ray_cast->sub_steps = sub_steps;
                    const glm::dvec4 seen = twin_pixel(scene, data, {0, 0}).rgba;
                    // All of the error in each of 20 sub-steps, and what the table's steps, which
                    // are an entry wide, are off by.
                    const double bound = 20.0 * span_tolerance(sub_steps) + 1.0 / 4095.0;
                    for (int c = 0; c < 4; ++c)
                        EXPECT_NEAR(seen[c], truth[c], bound)
                            << spacing_mm << " mm, " << sub_steps << " sub-steps, channel " << c;
                }
            }
        }
}

TEST(Convergence, ExactMaximaAndSurfacesAreThoseOfTheGrid) {
    auto [scene, data] = marschner_lobb();
    scene.value_and_depth = true;
    scene.ray_cast->integrator = Integrator::exact;
    scene.ray_cast->isos = {{0.3, glm::dvec3(1.0), 0.5}, {0.5}};
    for (const RayMode mode : {RayMode::mip, RayMode::iso}) {
        scene.ray_cast->mode = mode;
        const Image truth = render_truth(scene, data), twin = render_twin(scene, data);
        for (uint32_t y = 0; y < 24; ++y)
            for (uint32_t x = 0; x < 24; ++x)
                for (const size_t channel : {4u, 5u}) {
                    const float a = truth.at(x, y, channel), b = twin.at(x, y, channel);
                    EXPECT_EQ(std::isnan(a), std::isnan(b));
                    // Both are rounded to float; distances are below 8 mm.
                    EXPECT_FALSE(std::abs(a - b) > 1e-6) << a << " " << b;
                }
    }
}

TEST(Convergence, IsoDepthIsExactWhereNoCrossingIsMissed) {
    const Grid grid = make_grid({33, 33, 33}, glm::dvec3(1.0), glm::dvec3(-16.0));
    const SceneData data{sampled(grid, [](glm::dvec3 p) { return 12.0 - glm::length(p); }), {}};
    Scene scene = alpha_scene(value_is_opacity(), 0.5);
    scene.size_px = {32, 32};
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{0.0, glm::dvec3(1.0), 0.5}, {4.0, glm::dvec3(1.0, 0, 0), 1.0}};
    scene.value_and_depth = true;
    scene.camera = frame_volume(grid, {0.5, -1.0, 0.3}, {0, 0, 1}, 0.6);
    const Image truth = render_truth(scene, data), twin = render_twin(scene, data);
    int hits = 0, missed = 0, far = 0;
    for (uint32_t y = 0; y < 32; ++y)
        for (uint32_t x = 0; x < 32; ++x) {
            const float a = truth.at(x, y, 5), b = twin.at(x, y, 5);
            hits += std::isnan(a) ? 0 : 1;
            missed += std::isnan(a) != std::isnan(b) ? 1 : 0;
            far += std::abs(a - b) > 1e-3f ? 1 : 0; // voxels: the goal for depth
        }
    EXPECT_GT(hits, 200);
    // False position closes in slowly where a ray grazes the sphere, along its silhouette only.
    EXPECT_LE(far, hits / 50);
    EXPECT_LE(missed, 2) << "only where the sphere is grazed between two samples";
}

} // namespace
} // namespace palpate
