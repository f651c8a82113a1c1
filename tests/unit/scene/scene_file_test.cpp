#include "engine/scene/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "engine/base/file.h"
#include "engine/scene/presets.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kFull = R"({
  "volume": "head.nrrd", "labels": "organs.nii.gz", "frame": 2, "series": "1.2.3",
  "size_px": [640, 480], "background": [0.1, 0.2, 0.3],
  "camera": {"projection": "orthographic", "eye_mm": [1, 2, 3], "target_mm": [0.1, 0, 0],
             "up": [0, 0, 2], "view_angle_deg": 45, "view_height_mm": 123.5},
  "stereo": {"layout": "anaglyph", "eye_separation_mm": 60, "convergence_mm": 400,
             "swap_eyes": true},
  "mirror": true,
  "ray_cast": {"mode": "iso", "integrator": "exact", "step_mm": 0.7, "sub_steps": 5,
               "isos": [{"value": -300, "opacity": 0.3}, {"value": 300, "color": [1, 0.5, 0]}],
               "transfer": {"window": [-200, 2000], "max_opacity": 0.5},
               "shading": {"ambient": 0.3, "shininess": 20},
               "light": {"azimuth_deg": -30, "elevation_deg": 45}, "ambient_occlusion_mm": 6,
               "min_transmittance": 0.01},
  "slices": [{"point_mm": [1, 2, 3], "normal": [0, 1, 0], "interpolation": "cubic",
              "slab_mm": 4, "slab_mode": "maximum"}, {"normal": [1, 0, 0]}],
  "slice_transfer": "ct-bone",
  "clip_planes": [{"point_mm": [5, 5, 5], "normal": [1, 1, 0]}, {"normal": [0, 0, 1]}],
  "label_layer": {"styles": [{"label": 3, "color": [1, 0, 0], "visible": false}],
                  "ray_cast_weight": 0.25, "slice_opacity": 0.5, "outline_px": 2},
  "surfaces": [{"mesh": "skull.ply", "color": [1, 0.9, 0.8], "opacity": 0.4, "smooth": false,
                "shading": {"specular": 0.5}},
               {"iso": 300}, {"iso": 500, "live": true}, {"labels": true, "opacity": 0.7,
                "styles": [{"label": 2, "opacity": 0}, {"label": 5, "color": [0, 1, 0]}]}],
  "surface_depth": 4,
  "value_and_depth": true
})";

Result<SceneFile> parse(const std::string& text) {
    return parse_scene(text, "case.json");
}

// As a scene names it: the volume decides the unit of its opacity.
TransferFunction open_preset(std::string_view name) {
    TransferFunction function = *preset(name);
    function.opacity_unit_mm = 0.0;
    return function;
}

std::string message(const std::string& text) {
    const Result<SceneFile> result = parse(text);
    return result ? "accepted" : result.error().message;
}

TEST(SceneFile, KeepsATransparentBackground) {
    const SceneFile file = parse_scene(R"({"background": "transparent"})", "f").value();
    EXPECT_TRUE(file.transparent);
    EXPECT_EQ(file.scene.background, glm::dvec3(0.0));
    EXPECT_TRUE(parse_scene(write_scene(file), "g").value().transparent);
    EXPECT_FALSE(parse_scene("{}", "h").value().transparent);
}

TEST(SceneFile, ReadsEveryKey) {
    const Result<SceneFile> file = parse(kFull);
    ASSERT_TRUE(file) << file.error().message;
    const Scene& scene = file->scene;
    EXPECT_EQ(file->volume, "head.nrrd");
    EXPECT_EQ(file->labels, "organs.nii.gz");
    EXPECT_EQ(file->frame, 2u);
    EXPECT_EQ(file->series, "1.2.3");
    EXPECT_EQ(scene.size_px, glm::uvec2(640, 480));
    EXPECT_EQ(scene.camera.projection, Projection::orthographic);
    EXPECT_EQ(scene.camera.view_height_mm, 123.5);
    EXPECT_EQ(scene.stereo->layout, StereoLayout::anaglyph);
    EXPECT_TRUE(scene.stereo->swap_eyes);
    EXPECT_TRUE(scene.mirror);
    EXPECT_EQ(scene.ray_cast->mode, RayMode::iso);
    EXPECT_EQ(scene.ray_cast->integrator, Integrator::exact);
    EXPECT_EQ(scene.ray_cast->sub_steps, 5u);
    ASSERT_EQ(scene.ray_cast->isos.size(), 2u);
    EXPECT_EQ(scene.ray_cast->isos[0].opacity, 0.3);
    EXPECT_EQ(scene.ray_cast->isos[1].color, glm::dvec3(1, 0.5, 0));
    EXPECT_EQ(opacity_at(scene.ray_cast->transfer, 900.0), 0.25);
    EXPECT_EQ(scene.ray_cast->shading->shininess, 20.0);
    EXPECT_EQ(scene.ray_cast->shading->diffuse, Shading{}.diffuse);
    EXPECT_EQ(scene.slices[0].slab_mode, SlabMode::maximum);
    EXPECT_EQ(file->centered_slices, std::vector<size_t>{1});
    EXPECT_EQ(file->centered_clips, std::vector<size_t>{1});
    EXPECT_EQ(scene.slice_transfer, open_preset("ct-bone"));
    EXPECT_FALSE(scene.labels->styles[3].visible);
    EXPECT_TRUE(scene.labels->styles[2].visible);
    EXPECT_TRUE(scene.value_and_depth);
}

TEST(SceneFile, ReadsSurfacesAndWhereTheyComeFrom) {
    const Result<SceneFile> file = parse(kFull);
    ASSERT_TRUE(file) << file.error().message;
    const Scene& scene = file->scene;
    ASSERT_EQ(scene.surfaces.size(), 4u);
    EXPECT_EQ(scene.surface_depth, 4u);
    EXPECT_EQ(file->surfaces[0], (SurfaceSource{.mesh = "skull.ply", .iso = {}}));
    EXPECT_EQ(file->surfaces[1], (SurfaceSource{.mesh = "", .iso = 300.0}));
    EXPECT_EQ(file->surfaces[2], (SurfaceSource{.mesh = "", .iso = 500.0}));
    EXPECT_EQ(scene.surfaces[2].live_iso, 500.0);
    EXPECT_EQ(file->surfaces[3], (SurfaceSource{.mesh = "", .iso = {}, .labels = true}));
    EXPECT_EQ(scene.surfaces[0].style, (SurfaceStyle{{1.0, 0.9, 0.8}, 0.4}));
    EXPECT_FALSE(scene.surfaces[0].smooth);
    EXPECT_EQ(scene.surfaces[0].shading.specular, 0.5);
    EXPECT_EQ(scene.surfaces[1], SurfaceLayer{});
    EXPECT_EQ(style_of(scene.surfaces[3], 2).opacity, 0.0);
    EXPECT_EQ(style_of(scene.surfaces[3], 5).color, glm::dvec3(0, 1, 0));
    EXPECT_EQ(style_of(scene.surfaces[3], 5).opacity, 0.7);
    EXPECT_EQ(style_of(scene.surfaces[3], 77).opacity, 0.7) << "a label without style";
    EXPECT_THAT(
        message(R"({"surfaces": [{"mesh": "a.ply", "iso": 3}]})"),
        HasSubstr("surfaces[0]: expected one of \"mesh\", \"iso\" and \"labels\", found 2"));
    EXPECT_THAT(message(R"({"surfaces": [{"labels": true}]})"), HasSubstr("found none"));
    EXPECT_THAT(message(R"({"surfaces": [{"mesh": "a.ply", "live": true}]})"),
                HasSubstr("expected \"iso\" or \"labels\" beside \"live\", found none"));
    EXPECT_THAT(message(R"({"surface_depth": 17})"), HasSubstr("surface_depth"));
}

TEST(SceneFile, WrittenTextReadsBackAsTheSameScene) {
    for (const char* text : {kFull, R"({"volume": "a.nii"})",
                             R"({"camera": {"direction": [0, -1, 0.5], "fill": 0.7}})"}) {
        const Result<SceneFile> first = parse(text);
        ASSERT_TRUE(first) << first.error().message;
        const std::string written = write_scene(*first);
        const Result<SceneFile> second = parse_scene(written, "written.json");
        ASSERT_TRUE(second) << second.error().message << "\n" << written;
        EXPECT_EQ(first->scene, second->scene);
        EXPECT_EQ(first->framing, second->framing);
        EXPECT_EQ(first->centered_slices, second->centered_slices);
        EXPECT_EQ(written, write_scene(*second));
        EXPECT_EQ(scene_hash(*first), scene_hash(*second));
    }
}

TEST(SceneFile, HashFollowsTheSceneAndNotTheLayoutOfTheText) {
    const auto hash = [](const char* text) { return scene_hash(*parse(text)); };
    EXPECT_EQ(hash(R"({"volume":"a.nii","size_px":[8,8]})"),
              hash("{ \"size_px\": [8.0, 8],\n \"volume\": \"a.nii\" }"));
    EXPECT_NE(hash(R"({"volume":"a.nii","size_px":[8,8]})"),
              hash(R"({"volume":"a.nii","size_px":[8,9]})"));
    EXPECT_EQ(hash("{}").size(), 16u);
}

TEST(SceneFile, ErrorsNameFileLineKeyExpectedAndFound) {
    EXPECT_EQ(message("{\"ray_cast\": {\"mode\": \"iso\",\n \"isos\": [{\"value\": 1},\n"
                      " {\"value\": \"x\"}]}}"),
              "case.json:3: ray_cast.isos[1].value: expected a number from -1e+30 to 1e+30, "
              "found \"x\"");
    EXPECT_EQ(message("{\n\n\"size_pix\": [1, 1]}"),
              "case.json:3: unknown key \"size_pix\"; did you mean \"size_px\"?");
    EXPECT_EQ(
        message("{\"camera\": {\"eye\": [0,0,0]}}"),
        "case.json:1: camera: unknown key \"eye\"; known keys: projection, eye_mm, "
        "target_mm, up, view_angle_deg, view_height_mm, pixel_aspect, shift, direction, fill");
    EXPECT_EQ(message("{\"size_px\": [0,\n 5]}"),
              "case.json:1: size_px[0]: expected a whole number from 1 to 16384, found 0");
    EXPECT_EQ(message("[]"), "case.json:1: expected an object, found a list of 0");
}

TEST(SceneFile, RefusesWhatNoSceneCanMean) {
    const struct {
        const char* text;
        const char* says;
    } cases[] = {
        {R"({"size_px": [16385, 1]})", "size_px[0]: expected a whole number from 1 to 16384"},
        {R"({"size_px": [1.5, 1]})", "size_px[0]"},
        {R"({"background": [0, 0, 2]})", "background[2]: expected a number from 0 to 1, found 2"},
        {R"({"camera": {"eye_mm": [0,0,0], "target_mm": [0,0,0]}})", "the same point"},
        {R"({"camera": {"eye_mm": [0,0,0], "target_mm": [0,0,1], "up": [0,0,3]}})", "parallel"},
        {R"({"camera": {"direction": [0,0,0]}})", "length 0"},
        {R"({"camera": {"view_angle_deg": 180}})", "view_angle_deg"},
        {R"({"camera": {"eye_mm": [1e300,0,0]}})", "eye_mm[0]"},
        {R"({"ray_cast": {"mode": "mip"}})", "\"transfer\""},
        {R"({"ray_cast": {"mode": "iso"}})", "\"isos\""},
        {R"({"ray_cast": {"mode": "xray", "transfer": "mr"}})",
         "expected one of \"alpha\", \"mip\", \"iso\", found \"xray\""},
        {R"({"ray_cast": {"mode": "iso", "isos": []}})", "a list of 1 to 8"},
        {R"({"ray_cast": {"mode": "iso", "isos": [{"value": 2}, {"value": 2}]}})",
         "iso-values that rise"},
        {R"({"ray_cast": {"mode": "iso", "isos": [{"value": 2, "opacity": 0}]}})", "opacity"},
        {R"({"ray_cast": {"step_mm": -1, "transfer": "mr"}})", "step_mm"},
        {R"({"ray_cast": {"sub_steps": 0, "transfer": "mr"}})", "sub_steps"},
        {R"({"ray_cast": {"sub_steps": 65, "transfer": "mr"}})", "sub_steps"},
        {R"({"ray_cast": {"step_mm": 1e-300, "transfer": "mr"}})", "step_mm"},
        {R"({"ray_cast": {"transfer": "ct-bones"}})", "expected a preset"},
        {R"({"ray_cast": {"transfer": "nowhere.json"}})", "nowhere.json: no such file"},
        {R"({"ray_cast": {"transfer": {"window": [5, 5]}}})", "low < high"},
        {R"({"ray_cast": {"transfer": {"colors": [[1,0,0,0],[0,0,0,0]], "opacities": [[0,0]]}}})",
         "sorted by value"},
        {R"({"ray_cast": {"transfer": {"colors": [[0,0,0,0]]}}})", "\"opacities\""},
        {R"({"slices": [{}]})", "slice_transfer"},
        {R"({"slice_transfer": "mr", "slices": [{"normal": [0, 0, 0]}]})", "slices[0].normal"},
        {R"({"clip_planes": [{},{},{},{},{},{},{},{},{}]})", "a list of 0 to 8"},
        {R"({"label_layer": {"styles": [{"label": 70000}]}})", "65535"},
        {R"({"frame": -1})", "frame"},
        {R"({"value_and_depth": 1})", "true or false"},
        {R"({"volume": 5})", "volume: expected a text, found 5"},
    };
    for (const auto& c : cases)
        EXPECT_THAT(message(c.text), testing::AllOf(StartsWith("case.json:1: "), HasSubstr(c.says)))
            << c.text;
}

TEST(SceneFile, RefusesDamagedText) {
    EXPECT_THAT(
        message("{\"volume\": \"a\",\n\"frame\": 1e999}"),
        testing::AllOf(StartsWith("case.json:2: not readable as JSON"), HasSubstr("1e999")));
    EXPECT_THAT(message("{\"volume\": NaN}"), StartsWith("case.json:1: not readable as JSON"));
    EXPECT_THAT(message("{\"volume\": \"a\",\n\"volume\": \"b\"}"), HasSubstr("appears twice"));
    EXPECT_THAT(message(std::string(100000, '[')), HasSubstr("levels of nesting"));
    EXPECT_THAT(message(""), StartsWith("case.json:1: not readable as JSON"));
    const std::string full = kFull;
    for (size_t size = 0; size < full.size(); ++size)
        EXPECT_NE(message(full.substr(0, size)), "accepted") << size;
}

TEST(SceneFile, FindsFilesBesideTheScene) {
    const auto folder = std::filesystem::path(testing::TempDir()) / "palpate_scene_file";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "tf.json") << R"({"preset": "mr", "range": [0, 500]})";
    std::ofstream(folder / "scene.json")
        << R"({"volume": "v.nii", "ray_cast": {"transfer": "tf.json"}})";
    const Result<SceneFile> file = load_scene(folder / "scene.json");
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(volume_path(*file, file->volume), folder / "v.nii");
    EXPECT_EQ(volume_path(*file, "/data/v.nii"), "/data/v.nii");
    const TransferFunction expected = stretched(open_preset("mr"), 0.0, 500.0);
    EXPECT_EQ(file->scene.ray_cast->transfer, expected);
    EXPECT_EQ(*load_transfer_function(folder / "tf.json"), expected);
    std::filesystem::remove_all(folder);
}

TEST(SceneFile, VolumeDecidesWhatTheFileLeavesOpen) {
    const Result<SceneFile> file =
        parse(R"({"slice_transfer": "mr", "slices": [{}, {"point_mm": [1, 1, 1]}],
                  "clip_planes": [{}], "camera": {"direction": [1, 0, 0], "fill": 1}})");
    ASSERT_TRUE(file) << file.error().message;
    const Grid grid = make_grid({11, 21, 31}, {1, 1, 1}, {100, 200, 300});
    const Scene scene = resolved_scene(*file, grid);
    EXPECT_EQ(scene.slices[0].point_mm, glm::dvec3(105, 210, 315));
    EXPECT_EQ(scene.slices[1].point_mm, glm::dvec3(1, 1, 1));
    EXPECT_EQ(scene.clip_planes[0].point_mm, glm::dvec3(105, 210, 315));
    EXPECT_EQ(scene.camera, frame_volume(grid, {1, 0, 0}, {0, 0, 1}, 1.0));
}

TEST(SceneFile, ThePresetsOpacityIsByTheSizeOfTheVolumeAndTheGivenOneIsNot) {
    const auto unit = [](const char* transfer, double spacing_mm) {
        const Result<SceneFile> file =
            parse(fmt::format(R"({{"ray_cast": {{"transfer": {}}}}})", transfer));
        EXPECT_TRUE(file) << file.error().message;
        // The written scene says the same.
        const Result<SceneFile> again = parse(write_scene(*file));
        EXPECT_TRUE(again) << again.error().message;
        const Grid grid = make_grid({30, 40, 120}, glm::dvec3(spacing_mm));
        const Scene scene = resolved_scene(*again, grid);
        EXPECT_EQ(scene, resolved_scene(*file, grid));
        return scene.ray_cast->transfer.opacity_unit_mm;
    };
    // The diagonal is 130 samples long.
    for (const char* named : {R"("ct-bone")", R"({"preset": "mr", "range": [0, 5]})",
                              R"({"preset": "mr", "opacity_unit_mm": 0})"}) {
        EXPECT_DOUBLE_EQ(unit(named, 0.01), 1.3 / 200.0) << named;
        EXPECT_EQ(unit(named, 2.0), 1.0) << named;
        EXPECT_EQ(unit(named, 15.0), 1.0) << named;
        EXPECT_DOUBLE_EQ(unit(named, 1000.0), 130000.0 / 2000.0) << named;
    }
    for (const char* given : {R"({"preset": "mr", "opacity_unit_mm": 1})", R"({"window": [0, 5]})",
                              R"({"colors": [[0, 1, 1, 1]], "opacities": [[0, 0.5]]})"})
        EXPECT_EQ(unit(given, 0.01), 1.0) << given;
}

TEST(Shading, OfDefaultsClipsNothing) {
    // Light is ambient + diffuse cos + specular cos^n; white is 1.
    const Shading light;
    EXPECT_LE(light.ambient + light.diffuse + light.specular, 1.0);
}

TEST(Presets, AreUsableTransferFunctions) {
    ASSERT_GE(preset_names().size(), 6u);
    for (const std::string_view name : preset_names()) {
        const TransferFunction function = *preset(name);
        // A preset must be what the reader accepts.
        const Json json = transfer_function_json(function);
        JsonErrors errors{"preset", {}};
        EXPECT_EQ(read_transfer_function(JsonValue(json, "", errors), {}), function) << name;
        EXPECT_FALSE(errors.first) << name << ": " << errors.first->message;
        EXPECT_EQ(opacity_at(function, -2000.0), 0.0) << name << ": air hides nothing";
    }
    EXPECT_FALSE(preset("ct-bones"));
}

TEST(SceneFile, WhatLiesOverSlicesAndAShiftedCameraAreWrittenAndRead) {
    const SceneFile file = parse_scene(R"({"volume": "a.nii", "fused": "b.nii", "overlay": "c.nii",
            "camera": {"eye_mm": [0, -9, 0], "pixel_aspect": 2, "shift": [0.25, -0.5]},
            "fusion_layer": {"opacity": 0.75, "transfer": {"window": [0, 10]}},
            "overlay_layer": {"slice_opacity": 0, "outline_px": 2, "edges": "voxels"},
            "slices": [{"slab_mm": 5, "slab_mode": "minimum"}],
            "slice_transfer": {"window": [0, 1]}})",
                                       "a.json")
                               .value();
    EXPECT_EQ(file.fused, "b.nii");
    EXPECT_EQ(file.scene.camera.shift, glm::dvec2(0.25, -0.5));
    EXPECT_EQ(file.scene.fusion->opacity, 0.75);
    EXPECT_EQ(file.scene.overlay->outline_px, 2.0);
    EXPECT_EQ(file.scene.overlay->edges, LabelEdges::voxels);
    EXPECT_EQ(file.scene.slices.front().slab_mode, SlabMode::minimum);
    const SceneFile again = parse_scene(write_scene(file), "again.json").value();
    EXPECT_EQ(again.scene, file.scene);
    EXPECT_EQ(again.fused, file.fused);
    EXPECT_EQ(again.overlay, file.overlay);
}

TEST(SceneFile, LiveLabelsAndTheirOpacityAreWrittenAndRead) {
    const SceneFile file = parse_scene(R"({"volume": "a.nii", "labels": "b.nii",
            "surfaces": [{"labels": true, "live": true, "opacity": 0.5}],
            "label_layer": {"styles": [{"label": 2, "opacity": 0.25},
                                       {"label": 3, "visible": false}]}})",
                                       "a.json")
                               .value();
    const SurfaceLayer& layer = file.scene.surfaces[0];
    EXPECT_TRUE(layer.live_labels);
    EXPECT_FALSE(layer.live_iso);
    EXPECT_EQ(style_of(layer, *file.scene.labels, 1).opacity, 0.5);
    EXPECT_EQ(style_of(layer, *file.scene.labels, 2).opacity, 0.125);
    EXPECT_EQ(style_of(layer, *file.scene.labels, 3).opacity, 0.0);
    EXPECT_EQ(style_of(layer, *file.scene.labels, 2).color, style_of(LabelLayer{}, 2).color);
    const SceneFile again = parse_scene(write_scene(file), "again.json").value();
    EXPECT_EQ(again.scene, file.scene);
    EXPECT_EQ(again.surfaces, file.surfaces);
}

} // namespace
} // namespace palpate
