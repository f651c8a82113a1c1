#include <algorithm>

#include "engine/base/json.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_file.h"
#include "engine/scene/scene_names.h"
#include "engine/scene/scene_settings.h"

namespace palpate {

namespace {

template <class Enum>
Json name_json(Enum value) {
    for (const auto& [name, candidate] : Names<Enum>::list)
        if (candidate == value)
            return name;
    return {};
}

Json camera_json(const SceneFile& file) {
    const Camera& camera = file.scene.camera;
    if (file.framing)
        return {{"direction", file.framing->direction},
                {"up", file.framing->up},
                {"fill", file.framing->fill},
                {"view_angle_deg", file.framing->view_angle_deg},
                {"projection", name_json(file.framing->projection)}};
    Json out{{"projection", name_json(camera.projection)},
             {"eye_mm", camera.eye_mm},
             {"target_mm", camera.target_mm},
             {"up", camera.up},
             {"view_angle_deg", camera.view_angle_deg},
             {"view_height_mm", camera.view_height_mm}};
    if (camera.pixel_aspect != 1.0)
        out["pixel_aspect"] = camera.pixel_aspect;
    if (camera.shift != glm::dvec2(0.0))
        out["shift"] = Json{camera.shift.x, camera.shift.y};
    return out;
}

// The order of keys decides scene_hash(): step_mm and sub_steps come before what is no number. The
// third row is ambient occlusion, which older scenes have no key for.
Json ray_cast_json(const RayCastLayer& layer) {
    const std::span<const Setting<RayCastLayer>> settings = kRayCastSettings;
    Json out{{"mode", name_json(layer.mode)}, {"integrator", name_json(layer.integrator)}};
    write_settings(out, layer, settings.first(2));
    if (layer.jitter_seed)
        out["jitter"] = *layer.jitter_seed;
    if (!layer.transfer.colors.empty())
        out["transfer"] = transfer_function_json(layer.transfer);
    if (!layer.isos.empty()) {
        Json isos = Json::array();
        for (const IsoSurface& iso : layer.isos)
            isos.push_back({{"value", iso.value}, {"color", iso.color}, {"opacity", iso.opacity}});
        out["isos"] = std::move(isos);
    }
    if (layer.shading)
        out["shading"] = settings_json<Shading>(*layer.shading, kShadingSettings);
    if (layer.light)
        out["light"] = settings_json<Light>(*layer.light, kLightSettings);
    write_settings(out, layer, settings.subspan(layer.occlusion_mm > 0.0 ? 2 : 3));
    return out;
}

bool holds(const std::vector<size_t>& list, size_t value) {
    return std::find(list.begin(), list.end(), value) != list.end();
}

Json slices_json(const SceneFile& file) {
    Json slices = Json::array();
    for (size_t i = 0; i < file.scene.slices.size(); ++i) {
        const SliceLayer& slice = file.scene.slices[i];
        Json out = Json::object();
        if (!holds(file.centered_slices, i))
            out["point_mm"] = slice.point_mm;
        out["normal"] = slice.normal;
        out["interpolation"] = name_json(slice.interpolation);
        write_settings<SliceLayer>(out, slice, kSliceSettings);
        out["slab_mode"] = name_json(slice.slab_mode);
        slices.push_back(std::move(out));
    }
    return slices;
}

Json clip_planes_json(const SceneFile& file) {
    Json planes = Json::array();
    for (size_t i = 0; i < file.scene.clip_planes.size(); ++i) {
        Json out = Json::object();
        if (!holds(file.centered_clips, i))
            out["point_mm"] = file.scene.clip_planes[i].point_mm;
        out["normal"] = file.scene.clip_planes[i].normal;
        planes.push_back(std::move(out));
    }
    return planes;
}

Json label_layer_json(const LabelLayer& layer) {
    Json styles = Json::array();
    for (size_t i = 1; i < layer.styles.size(); ++i) {
        const LabelStyle& style = layer.styles[i];
        Json one{{"label", i}, {"color", style.color}, {"visible", style.visible}};
        if (style.opacity != 1.0)
            one["opacity"] = style.opacity;
        styles.push_back(std::move(one));
    }
    Json out{{"styles", std::move(styles)}, {"edges", name_json(layer.edges)}};
    write_settings<LabelLayer>(out, layer, kLabelLayerSettings);
    return out;
}

Json surfaces_json(const SceneFile& file) {
    Json surfaces = Json::array();
    for (size_t i = 0; i < file.scene.surfaces.size(); ++i) {
        const SurfaceSource source = i < file.surfaces.size() ? file.surfaces[i] : SurfaceSource{};
        const SurfaceLayer& layer = file.scene.surfaces[i];
        Json out = Json::object();
        if (source.iso)
            out["iso"] = *source.iso;
        else if (source.labels)
            out["labels"] = true;
        else
            out["mesh"] = source.mesh;
        if (layer.live_iso || layer.live_labels)
            out["live"] = true;
        out["color"] = layer.style.color;
        write_settings<SurfaceStyle>(out, layer.style, kSurfaceStyleSettings);
        out["shading"] = settings_json<Shading>(layer.shading, kShadingSettings);
        out["smooth"] = layer.smooth;
        Json styles = Json::array();
        for (size_t label = 1; label < layer.label_styles.size(); ++label)
            styles.push_back({{"label", label},
                              {"color", layer.label_styles[label].color},
                              {"opacity", layer.label_styles[label].opacity}});
        out["styles"] = std::move(styles);
        surfaces.push_back(std::move(out));
    }
    return surfaces;
}

} // namespace

std::string write_scene(const SceneFile& file) {
    const Scene& scene = file.scene;
    Json out = Json::object();
    out["volume"] = file.volume;
    if (!file.labels.empty())
        out["labels"] = file.labels;
    if (!file.fused.empty())
        out["fused"] = file.fused;
    if (!file.overlay.empty())
        out["overlay"] = file.overlay;
    out["frame"] = file.frame;
    if (!file.series.empty())
        out["series"] = file.series;
    if (file.resample_slices)
        out["resample_slices"] = true;
    out["size_px"] = {scene.size_px.x, scene.size_px.y};
    if (file.transparent)
        out["background"] = "transparent";
    else
        out["background"] = scene.background;
    out["camera"] = camera_json(file);
    if (scene.stereo) {
        out["stereo"] = {{"layout", name_json(scene.stereo->layout)},
                         {"eye_separation_mm", scene.stereo->rig.eye_separation_mm},
                         {"convergence_mm", scene.stereo->rig.convergence_mm}};
        if (scene.stereo->swap_eyes)
            out["stereo"]["swap_eyes"] = true;
    }
    if (scene.mirror)
        out["mirror"] = true;
    if (scene.ray_cast)
        out["ray_cast"] = ray_cast_json(*scene.ray_cast);
    out["slices"] = slices_json(file);
    if (!scene.slice_transfer.colors.empty())
        out["slice_transfer"] = transfer_function_json(scene.slice_transfer);
    out["clip_planes"] = clip_planes_json(file);
    if (scene.labels)
        out["label_layer"] = label_layer_json(*scene.labels);
    if (scene.fusion) {
        out["fusion_layer"] = settings_json<FusionLayer>(*scene.fusion, kFusionSettings);
        if (!scene.fusion->transfer.colors.empty())
            out["fusion_layer"]["transfer"] = transfer_function_json(scene.fusion->transfer);
    }
    if (scene.overlay)
        out["overlay_layer"] = label_layer_json(*scene.overlay);
    if (!scene.surfaces.empty()) {
        out["surfaces"] = surfaces_json(file);
        write_settings<Scene>(out, scene, kSceneSettings);
    }
    out["value_and_depth"] = scene.value_and_depth;
    return json_text(out);
}

std::string scene_hash(const SceneFile& file) {
    uint64_t hash = 14695981039346656037u; // FNV-1a
    for (const char c : write_scene(file))
        hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return fmt::format("{:016x}", hash);
}

} // namespace palpate
