// Slices, labels, clip planes, stereo and missing data in the twin.

#include <gtest/gtest.h>

#include <limits>

#include "engine/reference/truth.h"
#include "tests/unit/reference/scenes.h"

namespace palpate {
namespace {

using namespace testing_scenes;

const Grid kGrid = make_grid({11, 11, 11}, {1, 1, 1}, glm::dvec3(-5.0));

SceneData ramp_along_x() {
    return {sampled(kGrid, [](glm::dvec3 p) { return (p.x + 5.0) / 10.0; }), {}};
}

Scene slice_scene(glm::dvec3 direction) {
    Scene scene;
    scene.size_px = {1, 1};
    scene.camera = along(direction, {2.0, 0.0, 0.0});
    scene.background = {0.1, 0.2, 0.3};
    scene.slice_transfer = window_function(0.0, 1.0, 1.0);
    scene.slices = {SliceLayer{}};
    scene.value_and_depth = true;
    return scene;
}

TEST(Slices, ShowTheValueWhereTheRayMeetsThePlane) {
    Scene scene = slice_scene({0, 0, -1});
    const SceneData data = ramp_along_x();
    const PixelSample seen = twin_pixel(scene, data, {0, 0});
    EXPECT_NEAR(seen.value, 0.7, 1e-7); // fp32 samples
    EXPECT_DOUBLE_EQ(seen.depth, 100.0);
    EXPECT_NEAR(seen.rgba.x, 0.7, 0.5 / 4095.0 + 1e-7) << "the nearest of 4096 entries";
    EXPECT_EQ(seen.rgba.w, 1.0);
    EXPECT_NEAR(truth_pixel(scene, data, {0, 0}).rgba.x, 0.7, 1e-7);

    EXPECT_EQ(twin_pixel(scene, data, {50, 0}).rgba, glm::dvec4(0.1, 0.2, 0.3, 0.0)) << "beside";
    scene.slices[0].point_mm.z = 5.0;
    EXPECT_DOUBLE_EQ(twin_pixel(scene, data, {0, 0}).depth, 95.0) << "the outermost samples";
    scene.slices[0].point_mm.z = 5.01;
    EXPECT_TRUE(std::isnan(twin_pixel(scene, data, {0, 0}).depth));
}

TEST(Slices, CubicReproducesAQuadraticAndLinearDoesNot) {
    const SceneData data{sampled(kGrid, [](glm::dvec3 p) { return p.x * p.x / 25.0; }), {}};
    Scene scene = slice_scene({0, 0, -1});
    scene.camera = along({0, 0, -1}, {2.5, 0, 0});
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).value, 0.26, 1e-7) << "mean of 4 and 9, over 25";
    scene.slices[0].interpolation = Interpolation::cubic;
    // Catmull-Rom has quadratic precision (Keys 1981).
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).value, 0.25, 1e-7);
}

TEST(Slices, SlabsTakeMeanAndMaximumInsideTheVolume) {
    const SceneData data{sampled(kGrid, [](glm::dvec3 p) { return (p.z + 5.0) / 10.0; }), {}};
    Scene scene = slice_scene({0, 0, -1});
    scene.slices[0].slab_mm = 4.0; // four samples, at -1.5, -0.5, 0.5, 1.5 mm
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).value, 0.5, 1e-7);
    scene.slices[0].slab_mode = SlabMode::maximum;
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).value, 0.65, 1e-7);
    scene.slices[0].slab_mm = 100.0;
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).value, 0.95, 1e-7) << "ten inside, ninety ignored";
}

TEST(Slices, StopTheRayAndShowThrough) {
    const SceneData data{sampled(kGrid, [](glm::dvec3) { return 0.5; }), {}};
    Scene scene = slice_scene({0, 0, -1});
    scene.ray_cast = alpha_scene({{{0.0, {1, 0, 0}}}, {{0.0, 0.2}}, 1.0}, 0.7).ray_cast;
    const PixelSample seen = twin_pixel(scene, data, {0, 0});
    const double through = std::pow(0.8, 5.0); // from the face at z = 5 to the slice at 0
    EXPECT_NEAR(seen.rgba.x, 1.0 - through + 0.5 * through, 1e-4);
    EXPECT_NEAR(seen.rgba.y, 0.5 * through, 1e-4);
    EXPECT_EQ(seen.rgba.w, 1.0);
    EXPECT_DOUBLE_EQ(seen.depth, 100.0);
}

// Label 1 where x < 0, label 2 where y > 2 (and x >= 0), on a grid of its own.
SceneData labelled() {
    SceneData data = ramp_along_x();
    const Grid grid = make_grid({20, 20, 20}, glm::dvec3(0.5), glm::dvec3(-4.75));
    data.labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 index) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(index));
        return p.x < 0.0 ? 1.0 : p.y > 2.0 ? 2.0 : 0.0;
    });
    return data;
}

TEST(Labels, FillAndOutlineSlices) {
    Scene scene = slice_scene({0, 0, -1});
    scene.labels = LabelLayer{};
    scene.labels->styles = {{}, {{0, 1, 0}, true}, {{0, 0, 1}, true}};
    scene.labels->slice_opacity = 0.25;
    scene.labels->edges = LabelEdges::voxels;
    const SceneData data = labelled();
    const auto at = [&](double x) {
        scene.camera = along({0, 0, -1}, {x, 0, 0});
        return glm::dvec3(twin_pixel(scene, data, {0, 0}).rgba);
    };
    const double table = 0.5 / 4095.0 + 1e-7;
    EXPECT_NEAR(at(1.5).x, 0.65, table) << "label 0 is not coloured";
    EXPECT_NEAR(at(-1.5).y, 0.75 * 0.35 + 0.25, table) << "filled";
    EXPECT_EQ(at(-0.5), glm::dvec3(0, 1, 0)) << "within a pixel (1 mm) of the border";
    scene.labels->outline_px = 0.0;
    EXPECT_NEAR(at(-0.5).y, 0.75 * 0.45 + 0.25, table);
    EXPECT_NEAR(at(-0.01).y, 0.75 * 0.499 + 0.25, table) << "the nearest voxel's label";
    EXPECT_NEAR(at(0.01).y, 0.501, table);
    scene.labels->styles[1].visible = false;
    EXPECT_NEAR(at(-0.5).y, 0.45, table);
}

TEST(Labels, TintOrHideWhatIsRayCast) {
    const SceneData data = labelled();
    Scene scene = alpha_scene({{{0.0, {1, 1, 1}}}, {{0.0, 0.3}}, 1.0}, 0.5);
    scene.labels = LabelLayer{};
    scene.labels->styles = {{}, {{0, 1, 0}, true}};
    scene.labels->ray_cast_weight = 0.5;
    scene.camera = along({0, 0, -1}, {-2, 0, 0});
    const double hidden = 1.0 - std::pow(0.7, 10.0);
    for (const auto pixel : {&twin_pixel, &truth_pixel}) {
        scene.labels->styles[1].visible = true;
        const PixelSample tinted = pixel(scene, data, {0, 0}, 0);
        EXPECT_NEAR(tinted.rgba.w, hidden, 1e-6);
        // The label map ends at |z| = 5 as the volume does, so all of the ray is tinted.
        EXPECT_NEAR(tinted.rgba.x, 0.5 * hidden, 1e-6);
        EXPECT_NEAR(tinted.rgba.y, hidden, 1e-6);
        scene.labels->styles[1].visible = false;
        EXPECT_EQ(pixel(scene, data, {0, 0}, 0).rgba.w, 0.0);
        // Rays that are not tinted are those of a scene without labels, whatever is hidden.
        scene.labels->ray_cast_weight = 0.0;
        EXPECT_NEAR(pixel(scene, data, {0, 0}, 0).rgba.x, hidden, 1e-6);
        scene.labels->ray_cast_weight = 0.5;
    }
}

TEST(ClipPlanes, CutTheRayExactly) {
    const SceneData data{sampled(kGrid, [](glm::dvec3) { return 0.5; }), {}};
    Scene scene = alpha_scene({{{0.0, {1, 1, 1}}}, {{0.0, 0.1}}, 1.0}, 0.7);
    scene.camera = along({1, 0, 0}, {0, 0, 0});
    scene.clip_planes = {{{-1.3, 7, 7}, {2, 0, 0}}, {{2.2, 0, 0}, {-1, -1, 0}}};
    const double length = 2.2 + 1.3;
    EXPECT_NEAR(twin_pixel(scene, data, {0, 0}).rgba.w, 1.0 - std::pow(0.9, length), 1e-7);
    scene.clip_planes.push_back({{0, 0, 1}, {0, 0, 1}}); // parallel to the ray, which is outside
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).rgba.w, 0.0);
}

TEST(Twin, StereoEyesAreTheirOwnCameras) {
    const SceneData data = ramp_along_x();
    Scene scene = alpha_scene(value_is_opacity(), 0.5);
    scene.size_px = {9, 9};
    scene.camera = frame_volume(kGrid, {0, -1, 0.2}, {0, 0, 1});
    scene.stereo = StereoSettings{{6.0, 30.0}, StereoLayout::separate};
    const Image left = render_twin(scene, data, 0), right = render_twin(scene, data, 1);
    EXPECT_NE(left.samples, right.samples);
    const PixelSample pixel = twin_pixel(scene, data, {4, 4}, 1);
    EXPECT_EQ(right.at(4, 4, 3), static_cast<float>(pixel.rgba.w));
}

TEST(Twin, StrideTakesPixelsOfTheWholePicture) {
    const SceneData data = ramp_along_x();
    Scene scene = alpha_scene(value_is_opacity(), 0.5);
    scene.size_px = {17, 13};
    scene.camera = frame_volume(kGrid, {0, -1, 0.2}, {0, 0, 1});
    const Image whole = render_twin(scene, data);
    const Image part = render_twin(scene, data, 0, {4, {3, 2}});
    ASSERT_EQ(part.size_px, glm::uvec2(4, 3));
    for (uint32_t y = 0; y < 3; ++y)
        for (uint32_t x = 0; x < 4; ++x)
            EXPECT_EQ(part.at(x, y, 0), whole.at(3 + 4 * x, 2 + 4 * y, 0));
}

TEST(Iso, SurfacesLieInOrderWithTheirOwnColours) {
    const SceneData data = ramp_along_x();
    Scene scene = alpha_scene(value_is_opacity(), 3.0); // a step crosses two surfaces at once
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{0.25, {1, 0, 0}, 0.5}, {0.5, {0, 1, 0}, 0.5}, {0.55, {0, 0, 1}, 0.5}};
    scene.ray_cast->shading = Shading{1.0, 0.0, 0.0, 1.0}; // colours as given
    for (const auto pixel : {&twin_pixel, &truth_pixel}) {
        scene.camera = along({1, 0, 0}, {0, 0, 0});
        PixelSample seen = pixel(scene, data, {0, 0}, 0);
        EXPECT_NEAR(seen.depth, 100.0 - 2.5, 1e-6);
        EXPECT_EQ(seen.value, 0.25);
        EXPECT_LT(glm::length(seen.rgba - glm::dvec4(0.5, 0.25, 0.125, 0.875)), 1e-12);
        scene.camera = along({-1, 0, 0}, {0, 0, 0});
        seen = pixel(scene, data, {0, 0}, 0);
        EXPECT_NEAR(seen.depth, 100.0 - 0.5, 1e-6);
        EXPECT_LT(glm::length(seen.rgba - glm::dvec4(0.125, 0.25, 0.5, 0.875)), 1e-12);
    }
}

TEST(Iso, NothingIsDrawnAtTheBorderOfMissingData) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    // Low, a gap, high, a gap, low: no place is known where the value rises.
    const auto field = [&](glm::dvec3 p) {
        return std::abs(p.x) == 3.0 ? nan : 3.5 - std::abs(p.x);
    };
    const SceneData data{sampled(kGrid, field), {}};
    Scene scene = alpha_scene(value_is_opacity(), 0.4);
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{0.5, {1, 1, 1}, 1.0}};
    scene.camera = along({1, 0, 0}, {0, 0.2, 0.3});
    EXPECT_EQ(twin_pixel(scene, data, {0, 0}).rgba.w, 0.0);
    EXPECT_EQ(truth_pixel(scene, data, {0, 0}).rgba.w, 0.0);
}

TEST(Shading, FacesTheEyeOnEitherSide) {
    const SceneData data = ramp_along_x();
    Scene scene = alpha_scene(value_is_opacity(), 0.5);
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{0.5, {0.5, 0.25, 0.0}, 1.0}};
    const glm::dvec3 direction = glm::normalize(glm::dvec3(3, 4, 0));
    for (const double side : {1.0, -1.0}) {
        scene.camera = along(side * direction, {0, 0, 0});
        const double facing = 0.6; // the cosine between (3, 4, 0) / 5 and x
        const Shading by;          // iso shades with the defaults
        const double light = by.ambient + by.diffuse * facing;
        const double shine = by.specular * std::pow(facing, by.shininess);
        const glm::dvec4 seen = twin_pixel(scene, data, {0, 0}).rgba;
        EXPECT_NEAR(seen.x, 0.5 * light + shine, 1e-6);
        EXPECT_NEAR(seen.z, shine, 1e-6);
    }
}

} // namespace
} // namespace palpate
