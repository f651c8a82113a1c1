#include "engine/scene/scene_file.h"

#include <algorithm>

#include "engine/base/file.h"
#include "engine/base/json_value.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_names.h"
#include "engine/scene/scene_settings.h"

namespace palpate {

namespace {

constexpr double kLargestMm = 1e9;
constexpr double kLargestNumber = 1e30;
constexpr uint32_t kLargestLabel = 65535;

// read_x(object, "key", target) leaves the target as it is where there is no key.

void read_above(const JsonValue& in, const char* key, double low, double high, double& out) {
    if (const auto value = in.find(key))
        out = value->number_above(low, high);
}
void read_color(const JsonValue& in, const char* key, glm::dvec3& out) {
    if (const auto value = in.find(key))
        out = value->vector(0.0, 1.0);
}
void read_direction(const JsonValue& in, const char* key, glm::dvec3& out) {
    if (const auto value = in.find(key))
        out = value->direction();
}
bool read_point(const JsonValue& in, const char* key, glm::dvec3& out) {
    const auto value = in.find(key);
    if (value)
        out = value->vector(-kLargestMm, kLargestMm);
    return value.has_value();
}
template <class Enum>
void read_choice(const JsonValue& in, const char* key, Enum& out) {
    if (const auto value = in.find(key))
        out = value->choice(Names<Enum>::list);
}

void check_up(const JsonValue& in, glm::dvec3 forward, glm::dvec3 up) {
    const double sine = glm::length(glm::cross(glm::normalize(forward), glm::normalize(up)));
    if (!(sine > 1e-6))
        in.complain("expected \"up\" to differ from the view direction, found them parallel");
}

void read_camera(const JsonValue& in, SceneFile& file) {
    Camera& camera = file.scene.camera;
    if (in.find("direction")) {
        in.only_keys({"direction", "up", "fill", "view_angle_deg", "projection"});
        Framing framing;
        read_direction(in, "direction", framing.direction);
        read_direction(in, "up", framing.up);
        read_above(in, "fill", 0.0, 1e6, framing.fill);
        read_above(in, "view_angle_deg", 0.0, 179.0, framing.view_angle_deg);
        read_choice(in, "projection", framing.projection);
        check_up(in, framing.direction, framing.up);
        file.framing = framing;
        return;
    }
    if (!in.only_keys({"projection", "eye_mm", "target_mm", "up", "view_angle_deg",
                       "view_height_mm", "pixel_aspect", "shift", "direction", "fill"}))
        return;
    if (in.find("fill"))
        in.complain("expected \"direction\" beside \"fill\", found none");
    read_choice(in, "projection", camera.projection);
    read_point(in, "eye_mm", camera.eye_mm);
    read_point(in, "target_mm", camera.target_mm);
    read_direction(in, "up", camera.up);
    read_above(in, "view_angle_deg", 0.0, 179.0, camera.view_angle_deg);
    read_above(in, "view_height_mm", 0.0, kLargestMm, camera.view_height_mm);
    read_above(in, "pixel_aspect", 0.0, 1e3, camera.pixel_aspect);
    if (const auto shift = in.find("shift"))
        if (const auto sides = shift->items(2, 2); sides.size() == 2)
            camera.shift = {sides[0].number(-1e3, 1e3), sides[1].number(-1e3, 1e3)};
    const glm::dvec3 forward = camera.target_mm - camera.eye_mm;
    if (!(glm::length(forward) > 1e-6))
        in.complain("expected \"eye_mm\" and \"target_mm\" to differ, found the same point");
    else
        check_up(in, forward, camera.up);
}

std::vector<IsoSurface> read_isos(const JsonValue& in) {
    std::vector<IsoSurface> isos;
    for (const JsonValue& item : in.items(1, kMaxIsos)) {
        IsoSurface iso{};
        if (!item.only_keys({"value", "color", "opacity"}))
            continue;
        if (!item.find("value"))
            item.complain("expected the key \"value\", found none");
        item.take("value", iso.value, -kLargestNumber, kLargestNumber);
        read_color(item, "color", iso.color);
        read_above(item, "opacity", 0.0, 1.0, iso.opacity);
        if (!isos.empty() && !(isos.back().value < iso.value))
            in.complain(fmt::format("expected iso-values that rise, found {} after {}", iso.value,
                                    isos.back().value));
        isos.push_back(iso);
    }
    return isos;
}

Shading read_shading(const JsonValue& in) {
    Shading shading;
    in.only_keys(keys_of<Shading>(kShadingSettings));
    read_settings<Shading>(in, shading, kShadingSettings);
    return shading;
}

Light read_light(const JsonValue& in) {
    Light light;
    in.only_keys(keys_of<Light>(kLightSettings));
    read_settings<Light>(in, light, kLightSettings);
    return light;
}

RayCastLayer read_ray_cast(const JsonValue& in, const std::filesystem::path& folder) {
    RayCastLayer layer;
    if (!in.only_keys(keys_of<RayCastLayer>(
            kRayCastSettings,
            {"mode", "integrator", "jitter", "transfer", "isos", "shading", "light"})))
        return layer;
    read_choice(in, "mode", layer.mode);
    read_choice(in, "integrator", layer.integrator);
    read_settings<RayCastLayer>(in, layer, kRayCastSettings);
    if (layer.step_mm > 0.0 && layer.step_mm < 1e-7)
        in.find("step_mm")->reject("0 or a number from 1e-07 to 1e+06");
    if (const auto jitter = in.find("jitter"))
        layer.jitter_seed = jitter->whole_number(0, ~0u);
    if (const auto transfer = in.find("transfer"))
        layer.transfer = read_transfer_function(*transfer, folder);
    else if (layer.mode != RayMode::iso)
        in.complain("expected the key \"transfer\", found none");
    if (const auto isos = in.find("isos"))
        layer.isos = read_isos(*isos);
    else if (layer.mode == RayMode::iso)
        in.complain("expected the key \"isos\" for mode \"iso\", found none");
    if (const auto shading = in.find("shading")) {
        if (!shading->is(Json::Kind::boolean))
            layer.shading = read_shading(*shading);
        else if (shading->boolean())
            layer.shading = Shading{};
    }
    if (const auto light = in.find("light"))
        layer.light = read_light(*light);
    return layer;
}

void read_slices(const JsonValue& in, SceneFile& file) {
    for (const JsonValue& item : in.items(0, kMaxSlices)) {
        SliceLayer slice;
        if (!item.only_keys(keys_of<SliceLayer>(
                kSliceSettings, {"point_mm", "normal", "interpolation", "slab_mode"})))
            return;
        if (!read_point(item, "point_mm", slice.point_mm))
            file.centered_slices.push_back(file.scene.slices.size());
        read_direction(item, "normal", slice.normal);
        read_choice(item, "interpolation", slice.interpolation);
        read_settings<SliceLayer>(item, slice, kSliceSettings);
        read_choice(item, "slab_mode", slice.slab_mode);
        file.scene.slices.push_back(slice);
    }
}

void read_clip_planes(const JsonValue& in, SceneFile& file) {
    for (const JsonValue& item : in.items(0, kMaxClipPlanes)) {
        ClipPlane plane;
        if (!item.only_keys({"point_mm", "normal"}))
            return;
        if (!read_point(item, "point_mm", plane.point_mm))
            file.centered_clips.push_back(file.scene.clip_planes.size());
        read_direction(item, "normal", plane.normal);
        file.scene.clip_planes.push_back(plane);
    }
}

// Styles by label. Labels in between keep what style_of(layer) gives without a list.
template <class Style, class Layer, class Read>
std::vector<Style> read_styles(const JsonValue& in, const Layer& layer,
                               std::initializer_list<std::string_view> keys, const Read& read) {
    std::vector<std::pair<uint32_t, Style>> given;
    uint32_t largest = 0;
    for (const JsonValue& item : in.items(0, kLargestLabel)) {
        if (!item.only_keys(keys))
            return {};
        uint32_t label = 1;
        if (!item.take("label", label, 1, kLargestLabel))
            item.complain("expected the key \"label\", found none");
        Style style = style_of(layer, label);
        read_color(item, "color", style.color);
        read(item, style);
        given.emplace_back(label, style);
        largest = std::max(largest, label);
    }
    std::vector<Style> styles;
    for (uint32_t i = 0; !given.empty() && i <= largest; ++i)
        styles.push_back(style_of(layer, i));
    for (const auto& [label, style] : given)
        styles[label] = style;
    return styles;
}

LabelLayer read_label_layer(const JsonValue& in) {
    LabelLayer layer;
    if (!in.only_keys(keys_of<LabelLayer>(kLabelLayerSettings, {"styles", "edges"})))
        return layer;
    read_settings<LabelLayer>(in, layer, kLabelLayerSettings);
    read_choice(in, "edges", layer.edges);
    if (const auto styles = in.find("styles"))
        layer.styles =
            read_styles<LabelStyle>(*styles, LabelLayer{}, {"label", "color", "visible", "opacity"},
                                    [](const JsonValue& item, LabelStyle& style) {
                                        item.take("visible", style.visible);
                                        item.take("opacity", style.opacity, 0.0, 1.0);
                                    });
    return layer;
}

FusionLayer read_fusion_layer(const JsonValue& in, const std::filesystem::path& folder) {
    FusionLayer layer;
    in.only_keys(keys_of<FusionLayer>(kFusionSettings, {"transfer"}));
    if (const auto transfer = in.find("transfer"))
        layer.transfer = read_transfer_function(*transfer, folder);
    read_settings<FusionLayer>(in, layer, kFusionSettings);
    return layer;
}

std::vector<SurfaceStyle> read_surface_styles(const JsonValue& in, const SurfaceLayer& layer) {
    return read_styles<SurfaceStyle>(
        in, layer, {"label", "color", "opacity"}, [](const JsonValue& item, SurfaceStyle& style) {
            read_settings<SurfaceStyle>(item, style, kSurfaceStyleSettings);
        });
}

void read_surfaces(const JsonValue& in, SceneFile& file) {
    for (const JsonValue& item : in.items(0, kMaxSurfaces)) {
        if (!item.only_keys({"mesh", "iso", "live", "labels", "color", "opacity", "shading",
                             "smooth", "styles"}))
            return;
        SurfaceSource source;
        SurfaceLayer layer;
        item.take("mesh", source.mesh);
        if (const auto iso = item.find("iso"))
            source.iso = iso->number(-kLargestNumber, kLargestNumber);
        item.take("labels", source.labels);
        const int sources = !source.mesh.empty() + source.iso.has_value() + source.labels;
        if (sources != 1)
            item.complain(
                fmt::format("expected one of \"mesh\", \"iso\" and \"labels\", found {}", sources));
        if (source.labels && file.labels.empty())
            item.complain("expected \"labels\" in the scene, too, found none");
        if (const auto live = item.find("live"); live && live->boolean()) {
            if (!source.iso && !source.labels)
                item.complain("expected \"iso\" or \"labels\" beside \"live\", found none");
            layer.live_iso = source.iso;
            layer.live_labels = source.labels;
        }
        read_color(item, "color", layer.style.color);
        read_settings<SurfaceStyle>(item, layer.style, kSurfaceStyleSettings);
        if (const auto shading = item.find("shading"))
            layer.shading = read_shading(*shading);
        item.take("smooth", layer.smooth);
        if (const auto styles = item.find("styles"))
            layer.label_styles = read_surface_styles(*styles, layer);
        file.surfaces.push_back(source);
        file.scene.surfaces.push_back(layer);
    }
}

StereoSettings read_stereo(const JsonValue& in) {
    StereoSettings stereo;
    in.only_keys({"layout", "eye_separation_mm", "convergence_mm", "swap_eyes"});
    read_choice(in, "layout", stereo.layout);
    read_above(in, "eye_separation_mm", 0.0, 1e6, stereo.rig.eye_separation_mm);
    read_above(in, "convergence_mm", 0.0, 1e6, stereo.rig.convergence_mm);
    if (const auto swap = in.find("swap_eyes"))
        stereo.swap_eyes = swap->boolean();
    return stereo;
}

void read_scene(const JsonValue& in, SceneFile& file) {
    if (!in.only_keys(
            {"volume",        "labels",          "fused",        "overlay",       "frame",
             "series",        "resample_slices", "size_px",      "background",    "camera",
             "stereo",        "mirror",          "ray_cast",     "slices",        "slice_transfer",
             "clip_planes",   "label_layer",     "fusion_layer", "overlay_layer", "surfaces",
             "surface_depth", "value_and_depth", "touch"}))
        return;
    // "touch": haptic parameters (docs/reference/scene.md), of which pictures read nothing.
    Scene& scene = file.scene;
    in.take("volume", file.volume);
    in.take("labels", file.labels);
    in.take("fused", file.fused);
    in.take("overlay", file.overlay);
    in.take("frame", file.frame, 0, 1'000'000);
    in.take("series", file.series);
    in.take("resample_slices", file.resample_slices);
    if (const auto size = in.find("size_px")) {
        const std::vector<JsonValue> sides = size->items(2, 2);
        if (sides.size() == 2)
            scene.size_px = {sides[0].whole_number(1, 16384), sides[1].whole_number(1, 16384)};
    }
    if (const auto background = in.find("background");
        background && background->is(Json::Kind::string)) {
        file.transparent = background->text() == "transparent";
        if (!file.transparent)
            background->reject("a colour [r, g, b] or \"transparent\"");
    } else {
        read_color(in, "background", scene.background);
    }
    if (const auto camera = in.find("camera"))
        read_camera(*camera, file);
    else
        file.framing = Framing{};
    if (const auto stereo = in.find("stereo"))
        scene.stereo = read_stereo(*stereo);
    if (const auto mirror = in.find("mirror"))
        scene.mirror = mirror->boolean();
    if (const auto ray_cast = in.find("ray_cast"))
        scene.ray_cast = read_ray_cast(*ray_cast, file.folder);
    if (const auto slices = in.find("slices"))
        read_slices(*slices, file);
    if (const auto transfer = in.find("slice_transfer"))
        scene.slice_transfer = read_transfer_function(*transfer, file.folder);
    else if (!scene.slices.empty() && scene.ray_cast)
        scene.slice_transfer = scene.ray_cast->transfer;
    if (!scene.slices.empty() && scene.slice_transfer.colors.empty())
        in.complain("expected the key \"slice_transfer\" for \"slices\", found none");
    if (const auto planes = in.find("clip_planes"))
        read_clip_planes(*planes, file);
    if (const auto layer = in.find("label_layer"))
        scene.labels = read_label_layer(*layer);
    else if (!file.labels.empty())
        scene.labels = LabelLayer{};
    if (const auto layer = in.find("overlay_layer"))
        scene.overlay = read_label_layer(*layer);
    else if (!file.overlay.empty())
        scene.overlay = LabelLayer{};
    if (const auto layer = in.find("fusion_layer"))
        scene.fusion = read_fusion_layer(*layer, file.folder);
    else if (!file.fused.empty())
        scene.fusion = FusionLayer{};
    if (const auto surfaces = in.find("surfaces"))
        read_surfaces(*surfaces, file);
    read_settings<Scene>(in, scene, kSceneSettings);
    in.take("value_and_depth", scene.value_and_depth);
}

} // namespace

Scene resolved_scene(const SceneFile& file, const Grid& grid) {
    Scene scene = file.scene;
    if (file.framing) {
        scene.camera = frame_volume(grid, file.framing->direction, file.framing->up,
                                    file.framing->fill, file.framing->view_angle_deg);
        scene.camera.projection = file.framing->projection;
    }
    if (scene.ray_cast)
        scene.ray_cast->transfer = sized(scene.ray_cast->transfer, grid);
    scene.slice_transfer = sized(scene.slice_transfer, grid);
    if (scene.fusion)
        scene.fusion->transfer = sized(scene.fusion->transfer, grid);
    for (const size_t i : file.centered_slices)
        scene.slices[i].point_mm = center_mm(grid);
    for (const size_t i : file.centered_clips)
        scene.clip_planes[i].point_mm = center_mm(grid);
    return scene;
}

bool is_synthetic(std::string_view volume) {
    return volume.starts_with("synthetic:");
}

std::filesystem::path volume_path(const SceneFile& file, std::string_view volume) {
    return file.folder / std::filesystem::path(volume); // an absolute path replaces the folder
}

Result<SceneFile> parse_scene(std::string_view text, const std::string& name,
                              const std::filesystem::path& folder) {
    PALPATE_TRY(const Json json, parse_json(text, name));
    JsonErrors errors{name, {}};
    SceneFile file;
    file.folder = folder;
    read_scene(JsonValue(json, "", errors), file);
    if (errors.first)
        return tl::unexpected<Error>(*errors.first);
    return file;
}

Result<SceneFile> load_scene(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, 16 << 20));
    return parse_scene(text, path.string(), path.parent_path());
}

} // namespace palpate
