// `--error` keeps its word.

#include "engine/accuracy/accuracy.h"

#include <gmock/gmock.h>

#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/random_accuracy.h"

namespace palpate {
namespace {

using namespace synthetic;

class AccuracyTest : public GpuTest {};

std::vector<std::pair<std::string, std::pair<Scene, SceneData>>> some_scenes() {
    std::vector<std::pair<std::string, std::pair<Scene, SceneData>>> scenes;
    const auto add = [&](std::string name, const Field& field, const Grid& grid, ScalarType type,
                         double noise_sigma, const TransferFunction& function) {
        Scene scene;
        scene.size_px = {24, 20};
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
    const Grid cube = make_grid({44, 44, 44}, glm::dvec3(2.2), glm::dvec3(-47.3));
    add("gyroid, two peaks", gyroid(37.0), cube, ScalarType::f32, 0.0,
        {{{-1.5, {0.2, 0.9, 0.4}}, {1.5, {0.9, 0.3, 0.8}}},
         {{-1.5, 0.0}, {-0.6, 0.0}, {-0.45, 0.4}, {-0.3, 0.0}, {0.5, 0.0}, {0.7, 0.6}, {0.9, 0.0}},
         2.5});
    add("slab, veil", slab({0, 4, 0}, {0.2, 1, 0.4}, 30.0, 5.0, 900.0, 50.0), flat, ScalarType::u16,
        20.0, {{{0.0, {0, 0, 0}}, {1000.0, {1, 1, 1}}}, {{100.0, 0.0}, {900.0, 0.08}}, 2.0});
    return scenes;
}

TEST_F(AccuracyTest, ScenesErrLessThanAskedFor) {
    Renderer renderer(device());
    size_t turn = 0, met = 0;
    std::vector<bool> used(3, false);
    for (const auto& [name, scene_and_data] : some_scenes()) {
        const auto& [scene, data] = scene_and_data;
        const double error = turn++ % 2 == 0 ? 1e-3 : 3e-2;
        const Result<AccuracyChoice> choice = choose_setting(renderer, scene, data, error);
        if (!choice) {
            EXPECT_NE(choice.error().message.find("the best that can be had"), std::string::npos);
            continue;
        }
        EXPECT_LE(choice->error_estimate, error);
        Scene chosen = scene;
        apply(choice->setting, data.volume.grid(), *chosen.ray_cast);
        chosen.ray_cast->min_transmittance = choice->min_transmittance;
        const Result<Frame> frame = renderer.render(chosen, data);
        ASSERT_TRUE(frame) << frame.error().message;
        const double found = color_rmse(frame->eyes[0], render_truth(scene, data));
        EXPECT_LE(found, choice->error_estimate + 0x1p-25)
            << name << ", " << text_of(choice->setting);
        std::printf("    %s: asked %.0e, estimate %.1e, found %.1e by %s\n", name.c_str(), error,
                    choice->error_estimate, found, text_of(choice->setting).c_str());
        used[static_cast<size_t>(choice->setting.integrator)] = true;
        ++met;
    }
    EXPECT_GE(met, 9u); // of twelve
    EXPECT_TRUE(used[0] && used[2]) << "coarse requests take fast, fine ones exact";
}

TEST_F(AccuracyTest, WhatCannotBeReachedIsRefusedWithWhatCanBe) {
    const auto scenes = some_scenes();
    const auto& [scene, data] = scenes[4].second; // of narrow peaks: more sub-steps err less
    Renderer renderer(device());
    const Result<AccuracyChoice> choice = choose_setting(renderer, scene, data, 1e-9);
    ASSERT_FALSE(choice);
    EXPECT_THAT(choice.error().message,
                testing::MatchesRegex("--error: expected at least .*, the best that can be had for "
                                      "this scene .by exact, 64 sub-steps., found 1e-09"));
    const double best = std::stod(choice.error().message.substr(27));
    const Result<AccuracyChoice> granted = choose_setting(renderer, scene, data, best);
    ASSERT_TRUE(granted) << granted.error().message;
    EXPECT_LE(granted->error_estimate, best);
    std::printf("    at best %.1e, by %s\n", best, text_of(granted->setting).c_str());
}

// Near-opaque matter of 3 mm samples, whose error no table of other scenes foretold.
TEST_F(AccuracyTest, DenseMatterErrsLessThanAskedFor) {
    const Grid grid = make_grid({12, 13, 11}, {3, 3, 3}, {-16, -16, -16});
    const SceneData data{
        make_volume(grid, ScalarType::i16,
                    [](glm::uvec3 i) { return (i.x + i.y + i.z) % 2 ? 1000.0 : 0.0; }),
        std::nullopt};
    Scene scene;
    scene.size_px = {40, 40};
    scene.camera = frame_volume(grid, {-0.8, -0.7, 0.25}, {0, 0, 1}, 0.75);
    scene.ray_cast = RayCastLayer{};
    scene.ray_cast->transfer = {
        {{0, {1, 0, 0}}, {1000, {0, 1, 0}}}, {{0, 0.99}, {1000, 0.99}}, 1.0};
    const Image truth = render_truth(scene, data);
    Renderer renderer(device());
    for (const double error : {2e-3, 5e-4}) {
        const Result<AccuracyChoice> choice = choose_setting(renderer, scene, data, error);
        ASSERT_TRUE(choice) << choice.error().message;
        Scene chosen = scene;
        apply(choice->setting, grid, *chosen.ray_cast);
        chosen.ray_cast->min_transmittance = choice->min_transmittance;
        const Result<Frame> frame = renderer.render(chosen, data);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_LE(color_rmse(frame->eyes[0], truth), error) << text_of(choice->setting);
    }
}

// accuracy_long_test.cpp has a thousand more.
TEST_F(AccuracyTest, RandomScenesErrLessThanGranted) {
    expect_promises_kept(device(), 1, 4);
}

TEST(UpperMean, IsAboveTheMeanOfThePopulation) {
    std::mt19937 random(5);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    int below = 0;
    for (int turn = 0; turn < 2000; ++turn) {
        const double power = 1.0 + 4.0 * uniform(); // the mean of u^p is 1 / (p + 1)
        std::vector<double> values;
        for (int i = 0; i < 100; ++i)
            values.push_back(std::pow(uniform(), power));
        below += upper_mean(values, 1e4, 1.0) < 1.0 / (power + 1.0);
        double sum = 0.0;
        for (const double value : values)
            sum += value / 100.0;
        EXPECT_NEAR(upper_mean(values, 100.0, 1.0), sum, 1e-12);
    }
    EXPECT_LE(below, 2 + 6); // 0.001 of 2000, and four standard deviations
}

} // namespace
} // namespace palpate
