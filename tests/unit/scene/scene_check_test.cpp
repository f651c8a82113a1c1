#include "engine/scene/scene_check.h"

#include <gtest/gtest.h>

#include <functional>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

Volume volume_of(ScalarType type) {
    return make_volume(make_grid({4, 4, 4}, glm::dvec3(1.0)), type, [](glm::uvec3) { return 1.0; });
}

TEST(CheckDrawable, SaysWhatOfASceneDoesNotFit) {
    const struct {
        const char* expected; // empty: it can be drawn
        std::function<void(Scene&, SceneData&)> spoil;
    } cases[] = {
        {"", [](Scene&, SceneData&) {}},
        {"a scene: expected a ray cast, a slice or a surface, found none",
         [](Scene& s, SceneData&) { s.ray_cast.reset(); }},
        {"a scene: expected one pixel or more, found 0 x 512",
         [](Scene& s, SceneData&) { s.size_px.x = 0; }},
        {"a scene: expected labels in the scene and in its data, found them in the scene alone",
         [](Scene& s, SceneData&) { s.labels.emplace(); }},
        {"a scene: expected labels in the scene and in its data, found them in the data alone",
         [](Scene&, SceneData& d) { d.labels = volume_of(ScalarType::u8); }},
        {"",
         [](Scene& s, SceneData& d) {
             s.labels.emplace();
             d.labels = volume_of(ScalarType::u16);
         }},
        {"a scene: expected labels of type u8 or u16, found f32",
         [](Scene& s, SceneData& d) {
             s.labels.emplace();
             d.labels = volume_of(ScalarType::f32);
         }},
        {"a scene: expected a camera whose direction is not along its up, found both parallel or 0",
         [](Scene& s, SceneData&) { s.camera.up = s.camera.target_mm - s.camera.eye_mm; }},
        {"a scene: expected slices and clip planes with a normal, found one of length 0",
         [](Scene& s, SceneData&) {
             s.clip_planes.push_back({{}, glm::dvec3(0.0)});
         }},
        {"a transfer function: expected a colour and an opacity at least, found 0 and 0",
         [](Scene& s, SceneData&) { s.slices.resize(1); }},
        {"a transfer function: expected a colour and an opacity at least, found 2 and 0",
         [](Scene& s, SceneData&) { s.ray_cast->transfer.opacities.clear(); }},
        {"", // iso-surfaces need none
         [](Scene& s, SceneData&) {
             s.ray_cast->mode = RayMode::iso;
             s.ray_cast->isos = {{0.5}};
             s.ray_cast->transfer = {};
         }},
        {"a transfer function: expected colours whose values do not fall, found 0",
         [](Scene& s, SceneData&) {
             std::swap(s.ray_cast->transfer.colors[0].value, s.ray_cast->transfer.colors[1].value);
         }},
        {"a transfer function: expected opacities of 0 .. 1, found 1.5",
         [](Scene& s, SceneData&) { s.ray_cast->transfer.opacities[1].opacity = 1.5; }},
        {"a transfer function: expected an opacity unit above 0 mm, found 0",
         [](Scene& s, SceneData&) { s.ray_cast->transfer.opacity_unit_mm = 0.0; }},
        {"a scene: expected iso-values that rise, found 1 after 1",
         [](Scene& s, SceneData&) {
             s.ray_cast->isos = {{1.0}, {1.0}};
         }},
        {"a scene: expected at most 8 slices, found 9",
         [](Scene& s, SceneData&) { s.slices.resize(9); }},
        {"a scene: expected at most 8 clip planes, found 9",
         [](Scene& s, SceneData&) { s.clip_planes.resize(9); }},
        {"a scene: expected at most 8 iso-values, found 9",
         [](Scene& s, SceneData&) { s.ray_cast->isos.resize(9); }},
        {"a scene: expected 1 meshes, one for each surface, found 0",
         [](Scene& s, SceneData&) { s.surfaces.resize(1); }},
        {"a scene: expected a mesh for surface 1, found none",
         [](Scene& s, SceneData& d) {
             s.surfaces.resize(1);
             d.meshes.push_back(nullptr);
         }},
        {"", // a live surface has none
         [](Scene& s, SceneData& d) {
             s.surfaces.resize(1);
             s.surfaces[0].live_iso = 0.5;
             d.meshes.push_back(nullptr);
         }},
        {"",
         [](Scene& s, SceneData& d) {
             s.surfaces.resize(1);
             s.surfaces[0].live_labels = true;
             d.meshes.push_back(nullptr);
         }},
        {"",
         [](Scene& s, SceneData& d) {
             s.surfaces.resize(1);
             d.meshes.push_back(std::make_shared<Mesh>());
         }},
        {"a scene: surface_depth: expected a whole number from 1 to 16, found 17",
         [](Scene& s, SceneData&) { s.surface_depth = 17; }},
    };
    for (const auto& [expected, spoil] : cases) {
        Scene scene;
        scene.ray_cast.emplace();
        scene.ray_cast->transfer = window_function(0.0, 1.0, 0.5);
        SceneData data{volume_of(ScalarType::i16), {}, {}};
        spoil(scene, data);
        const Result<void> checked = check_drawable(scene, data);
        EXPECT_EQ(checked ? "" : checked.error().message, expected);
    }
}

} // namespace
} // namespace palpate
