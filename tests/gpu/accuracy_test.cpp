// `--error` keeps its word on scenes that its table was not measured on.

#include "engine/scene/accuracy.h"

#include <gmock/gmock.h>

#include <cmath>

#include "engine/image/compare.h"
#include "engine/reference/truth.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

using namespace synthetic;

class AccuracyTest : public GpuTest {};

// Fields, grids, cameras and transfer functions that palpate_accuracy_table does not use.
std::vector<std::pair<std::string, std::pair<Scene, SceneData>>> held_out() {
    std::vector<std::pair<std::string, std::pair<Scene, SceneData>>> scenes;
    const auto add = [&](std::string name, const Field& field, const Grid& grid, ScalarType type,
                         double noise_sigma, const TransferFunction& function) {
        Scene scene;
        scene.size_px = {36, 32};
        scene.camera = frame_volume(grid, {-0.8, -0.7, 0.25}, {0, 0, 1}, 0.75);
        scene.background = {0.0, 0.1, 0.2};
        scene.ray_cast = RayCastLayer{};
        scene.ray_cast->transfer = function;
        const SceneData data{sample(field, grid, type, noise_sigma), std::nullopt};
        scenes.push_back({name + ", alpha", {scene, data}});
        scene.ray_cast->shading = Shading{};
        scenes.push_back({name + ", shaded", {scene, data}});
        scene.ray_cast->shading.reset();
        scene.ray_cast->mode = RayMode::mip;
        scenes.push_back({name + ", MIP", {scene, data}});
        scene.ray_cast->mode = RayMode::iso;
        const ValueRange range = data.volume.range();
        scene.ray_cast->isos = {{0.45 * range.min + 0.55 * range.max}};
        scenes.push_back({name + ", iso", {scene, data}});
    };
    const Grid flat = make_grid({56, 56, 24}, {1.8, 1.8, 4.2}, {-49.5, -49.5, -48.3});
    add("torus, window", torus({4, 1, -3}, 28.0, 13.0), flat, ScalarType::f32, 0.0,
        {{{-40.0, {1, 0.2, 0.2}}, {13.0, {0.3, 1, 0.9}}}, {{-20.0, 0.0}, {13.0, 0.3}}, 3.0});
    add("sphere, narrow peak", sphere({2, -3, 4}, 30.0, 6.0), flat, ScalarType::i16, 8.0,
        {{{0.0, {1, 1, 0.5}}, {1000.0, {0.5, 0.5, 1}}},
         {{0.0, 0.0}, {430.0, 0.0}, {445.0, 0.7}, {460.0, 0.0}, {1000.0, 0.0}},
         2.0});
    const Grid cube = make_grid({44, 44, 44}, glm::dvec3(2.2), glm::dvec3(-47.3));
    add("gyroid, two peaks", gyroid(37.0), cube, ScalarType::f32, 0.0,
        {{{-1.5, {0.2, 0.9, 0.4}}, {1.5, {0.9, 0.3, 0.8}}},
         {{-1.5, 0.0}, {-0.6, 0.0}, {-0.45, 0.4}, {-0.3, 0.0}, {0.5, 0.0}, {0.7, 0.6}, {0.9, 0.0}},
         2.5});
    add("shells, step", shells({3, 0, -2}, 21.0), cube, ScalarType::f32, 0.0,
        {{{0.0, {0.9, 0.9, 0.2}}, {1.0, {0.2, 0.4, 1}}},
         {{0.0, 0.0}, {0.6, 0.0}, {0.6, 0.3}},
         2.0});
    add("slab, veil", slab({0, 4, 0}, {0.2, 1, 0.4}, 30.0, 5.0, 900.0, 50.0), flat, ScalarType::u16,
        20.0, {{{0.0, {0, 0, 0}}, {1000.0, {1, 1, 1}}}, {{100.0, 0.0}, {900.0, 0.08}}, 2.0});
    return scenes;
}

TEST_F(AccuracyTest, HeldOutScenesErrLessThanAskedFor) {
    Renderer renderer(device());
    size_t met = 0, refused = 0;
    std::vector<bool> used(3, false);
    for (const auto& [name, scene_and_data] : held_out()) {
        const auto& [scene, data] = scene_and_data;
        const Image truth = render_truth(scene, data);
        for (const double error : {3e-2, 1e-2, 1e-3, 2e-4}) {
            const Result<AccuracyChoice> choice = choose_setting(scene, data, error);
            if (!choice) {
                EXPECT_NE(choice.error().message.find("the best that can be had"),
                          std::string::npos);
                ++refused;
                continue;
            }
            EXPECT_LE(choice->error_estimate, error);
            Scene chosen = scene;
            apply(choice->setting, data.volume.grid(), *chosen.ray_cast);
            chosen.ray_cast->min_transmittance = choice->min_transmittance;
            const Result<Frame> frame = renderer.render(chosen, data);
            ASSERT_TRUE(frame) << frame.error().message;
            const double found = color_rmse(frame->eyes[0], truth);
            EXPECT_LE(found, choice->error_estimate) << name << ", " << text_of(choice->setting);
            std::printf("    %s: asked %.0e, estimate %.1e, found %.1e by %s\n", name.c_str(),
                        error, choice->error_estimate, found, text_of(choice->setting).c_str());
            used[static_cast<size_t>(choice->setting.integrator)] = true;
            const std::optional<double> estimate = estimated_error(chosen, data);
            ASSERT_TRUE(estimate);
            EXPECT_LE(*estimate, choice->error_estimate * (1.0 + 1e-12));
            ++met;
        }
    }
    EXPECT_GT(met, 30u);
    EXPECT_TRUE(used[0] && used[2]) << "coarse requests take fast, fine ones exact";
    std::printf("    %zu met, %zu refused\n", met, refused);
}

TEST_F(AccuracyTest, WhatCannotBeReachedIsRefusedInOneSentence) {
    const auto scenes = held_out();
    const auto& [scene, data] = scenes.front().second;
    const Result<AccuracyChoice> choice = choose_setting(scene, data, 1e-9);
    ASSERT_FALSE(choice);
    EXPECT_THAT(choice.error().message,
                testing::MatchesRegex("--error: expected at least .*, the best that can be had for "
                                      "this scene .by .*., found 1e-09"));
}

} // namespace
} // namespace palpate
