// Meshes in the twin: places, order, caps and labels that can be told by hand.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/reference/truth.h"
#include "tests/unit/reference/scenes.h"

namespace palpate {
namespace {

using namespace testing_scenes;

const Grid kSurfaceGrid = make_grid({11, 11, 11}, {1, 1, 1}, glm::dvec3(-5.0));

// Nested cubes, an eye above them that looks down the z axis, one ray.
Mesh cube(double half_mm, uint16_t label = 0) {
    Mesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.positions.emplace_back(
            half_mm * (glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * 2.0 - 1.0));
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    if (label > 0)
        mesh.labels.assign(mesh.triangles.size(), label);
    return mesh;
}

SceneData data_of(std::vector<Mesh> meshes) {
    SceneData data{sampled(kSurfaceGrid, [](glm::dvec3) { return 0.5; }), std::nullopt, {}};
    for (Mesh& mesh : meshes)
        data.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
    return data;
}

Scene scene_of(std::vector<SurfaceLayer> surfaces) {
    Scene scene;
    scene.size_px = {1, 1};
    scene.camera = along({0, 0, -1}, {0.25, 0.125, 0.0}); // 100 mm above the middle
    scene.background = {0.0, 0.0, 1.0};
    scene.surfaces = std::move(surfaces);
    scene.value_and_depth = true;
    return scene;
}

// Ambient light alone: colours are as given.
SurfaceLayer plain(glm::dvec3 color, double opacity) {
    return {{color, opacity}, {}, {1.0, 0.0, 0.0, 1.0}, true};
}

TEST(Surfaces, LayersAreBlendedUpToTheFirstOpaqueOne) {
    const SceneData data = data_of({cube(3.0), cube(1.0)});
    Scene scene = scene_of({plain({1, 0, 0}, 0.5), plain({0, 1, 0}, 1.0)});
    const PixelSample seen = twin_pixel(scene, data, {0, 0});
    EXPECT_EQ(seen.rgba, glm::dvec4(0.5, 0.5, 0.0, 1.0));
    EXPECT_DOUBLE_EQ(seen.depth, 97.0);
    EXPECT_TRUE(std::isnan(seen.value)) << "no label";
    scene.surfaces[1].style.opacity = 0.5; // in, in, out, out
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).rgba,
              glm::dvec4(0.5 + 0.0625, 0.25 + 0.125, 0.0625, 1.0 - 0.0625));
    scene.surface_depth = 1;
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).rgba, glm::dvec4(0.5, 0.0, 0.5, 0.5));
    scene.surfaces[0].style.opacity = 0.0;
    scene.surfaces[1].style.opacity = 1.0;
    EXPECT_DOUBLE_EQ(twin_pixel(scene, data, {0, 0}).depth, 99.0);
    EXPECT_EQ(truth_pixel(scene, data, {0, 0}).rgba, glm::dvec4(0, 1, 0, 1));
}

TEST(Surfaces, CutsAreClosedInTheColourOfTheLayerListedLast) {
    const SceneData data = data_of({cube(3.0), cube(1.0)});
    Scene scene = scene_of({plain({1, 0, 0}, 1.0), plain({0, 1, 0}, 1.0)});
    const auto cut_at = [&](double z, double direction) {
        scene.clip_planes = {{{0, 0, z}, {0, 0, direction}}};
        return twin_pixel(scene, data, {0, 0});
    };
    EXPECT_EQ(cut_at(0.5, -1.0).rgba, glm::dvec4(0, 1, 0, 1)) << "inside both";
    EXPECT_DOUBLE_EQ(cut_at(0.5, -1.0).depth, 99.5);
    EXPECT_EQ(cut_at(2.0, -1.0).rgba, glm::dvec4(1, 0, 0, 1)) << "inside the outer one";
    EXPECT_DOUBLE_EQ(cut_at(2.0, -1.0).depth, 98.0);
    EXPECT_DOUBLE_EQ(cut_at(-2.0, -1.0).depth, 102.0);
    EXPECT_EQ(cut_at(-4.0, -1.0).rgba, glm::dvec4(0, 0, 1, 0)) << "all of it is cut away";
    EXPECT_DOUBLE_EQ(cut_at(2.5, 1.0).depth, 97.0) << "the far side is cut away";
    scene.surfaces[0].style.opacity = 0.5;
    // In through the outer cube's top, and out through its cap at 2.5 mm.
    EXPECT_EQ(cut_at(2.5, 1.0).rgba, glm::dvec4(0.75, 0.0, 0.25, 0.75));
}

TEST(Surfaces, WallsShowTheLabelBehindThemOrElseTheOneBefore) {
    // One wall at z = 1 between label 2 above and label 1 below, in a cube of 3 mm.
    Mesh mesh = cube(3.0, 1);
    for (size_t i = 0; i < mesh.triangles.size(); ++i)
        if (mesh.triangles[i].x >= 4 && mesh.triangles[i].y >= 4 && mesh.triangles[i].z >= 4)
            mesh.labels[i] = 2; // the top
    mesh.outer_labels.assign(mesh.triangles.size(), 0);
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const glm::vec2 at : {glm::vec2(-3, -3), {3, -3}, {-3, 3}, {3, 3}})
        mesh.positions.emplace_back(at, 1.0f);
    for (const glm::uvec3 t : {glm::uvec3(0, 1, 2), glm::uvec3(1, 3, 2)}) {
        mesh.triangles.push_back(t + first);
        mesh.labels.push_back(1);
        mesh.outer_labels.push_back(2);
    }
    const SceneData data = data_of({mesh});
    Scene scene = scene_of({plain({}, 1.0)});
    scene.surfaces[0].label_styles = {{}, {{1, 0, 0}, 1.0}, {{0, 1, 0}, 1.0}};
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).value, 2.0);
    EXPECT_DOUBLE_EQ(twin_pixel(scene, data, {0, 0}).depth, 97.0);
    scene.surfaces[0].label_styles[2].opacity = 0.0;
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).value, 1.0);
    EXPECT_DOUBLE_EQ(twin_pixel(scene, data, {0, 0}).depth, 99.0);
    scene.surfaces[0].label_styles[2].opacity = 0.5;
    scene.surfaces[0].label_styles[1].opacity = 0.0; // its wall from within, then nothing
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).rgba, glm::dvec4(0.0, 0.75, 0.25, 0.75));
    scene.surfaces[0].label_styles[1].opacity = 1.0;
    scene.clip_planes = {{{0, 0, 0.5}, {0, 0, -1}}};
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).value, 1.0) << "a cap";
    EXPECT_DOUBLE_EQ(twin_pixel(scene, data, {0, 0}).depth, 99.5);
    scene.clip_planes[0].point_mm.z = 2.0;
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).value, 2.0);
}

TEST(Surfaces, EndRaysAndLieBetweenTheirStretches) {
    const SceneData data = data_of({cube(3.0)});
    Scene scene = scene_of({plain({1, 0, 0}, 1.0)});
    scene.ray_cast = alpha_scene({{{0.0, {0, 1, 0}}}, {{0.0, 0.2}}, 1.0}, 0.7).ray_cast;
    const double through = std::pow(0.8, 2.0); // from z = 5, the end of the samples, to 3
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).rgba.x, through, 1e-4);
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).rgba.y, 1.0 - through, 1e-4);
    scene.surfaces[0].style.opacity = 0.5;
    const double within = std::pow(0.8, 6.0);
    const PixelSample seen = twin_pixel(scene, data, {0, 0});
    EXPECT_NEAR(seen.rgba.x, through * 0.5 + through * 0.5 * within * 0.5, 1e-4);
    EXPECT_NEAR(seen.rgba.z, through * 0.5 * within * 0.5 * through, 1e-4) << "the background";
    EXPECT_NEAR(truth_pixel(scene, data, {0, 0}).rgba.x, seen.rgba.x, 1e-4);
}

} // namespace
} // namespace palpate
