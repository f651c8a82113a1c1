#include <algorithm>

#include "engine/base/json.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_file.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

template <class Enum>
Json name_json(Enum value) {
    for (const auto& [name, candidate] : Names<Enum>::list)
        if (candidate == value)
            return Json::of(name);
    return {};
}

Json vector_json(glm::dvec3 v) {
    return Json::array({Json::of(v.x), Json::of(v.y), Json::of(v.z)});
}

Json camera_json(const SceneFile& file) {
    const Camera& camera = file.scene.camera;
    if (file.framing)
        return Json::object({{"direction", vector_json(file.framing->direction)},
                             {"up", vector_json(file.framing->up)},
                             {"fill", Json::of(file.framing->fill)},
                             {"view_angle_deg", Json::of(file.framing->view_angle_deg)},
                             {"projection", name_json(file.framing->projection)}});
    return Json::object({{"projection", name_json(camera.projection)},
                         {"eye_mm", vector_json(camera.eye_mm)},
                         {"target_mm", vector_json(camera.target_mm)},
                         {"up", vector_json(camera.up)},
                         {"view_angle_deg", Json::of(camera.view_angle_deg)},
                         {"view_height_mm", Json::of(camera.view_height_mm)}});
}

Json shading_json(const Shading& shading) {
    return Json::object({{"ambient", Json::of(shading.ambient)},
                         {"diffuse", Json::of(shading.diffuse)},
                         {"specular", Json::of(shading.specular)},
                         {"shininess", Json::of(shading.shininess)}});
}

Json ray_cast_json(const RayCastLayer& layer) {
    Json out = Json::object({{"mode", name_json(layer.mode)},
                             {"integrator", name_json(layer.integrator)},
                             {"step_mm", Json::of(layer.step_mm)},
                             {"sub_steps", Json::of(static_cast<double>(layer.sub_steps))}});
    if (layer.jitter_seed)
        out.members.emplace_back("jitter", Json::of(static_cast<double>(*layer.jitter_seed)));
    if (!layer.transfer.colors.empty())
        out.members.emplace_back("transfer", transfer_function_json(layer.transfer));
    if (!layer.isos.empty()) {
        Json isos = Json::array();
        for (const IsoSurface& iso : layer.isos)
            isos.items.push_back(Json::object({{"value", Json::of(iso.value)},
                                               {"color", vector_json(iso.color)},
                                               {"opacity", Json::of(iso.opacity)}}));
        out.members.emplace_back("isos", std::move(isos));
    }
    if (layer.shading)
        out.members.emplace_back("shading", shading_json(*layer.shading));
    out.members.emplace_back("min_transmittance", Json::of(layer.min_transmittance));
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
            out.members.emplace_back("point_mm", vector_json(slice.point_mm));
        out.members.emplace_back("normal", vector_json(slice.normal));
        out.members.emplace_back("interpolation", name_json(slice.interpolation));
        out.members.emplace_back("slab_mm", Json::of(slice.slab_mm));
        out.members.emplace_back("slab_mode", name_json(slice.slab_mode));
        slices.items.push_back(std::move(out));
    }
    return slices;
}

Json clip_planes_json(const SceneFile& file) {
    Json planes = Json::array();
    for (size_t i = 0; i < file.scene.clip_planes.size(); ++i) {
        Json out = Json::object();
        if (!holds(file.centered_clips, i))
            out.members.emplace_back("point_mm", vector_json(file.scene.clip_planes[i].point_mm));
        out.members.emplace_back("normal", vector_json(file.scene.clip_planes[i].normal));
        planes.items.push_back(std::move(out));
    }
    return planes;
}

Json label_layer_json(const LabelLayer& layer) {
    Json styles = Json::array();
    for (size_t i = 1; i < layer.styles.size(); ++i)
        styles.items.push_back(Json::object({{"label", Json::of(static_cast<double>(i))},
                                             {"color", vector_json(layer.styles[i].color)},
                                             {"visible", Json::of(layer.styles[i].visible)}}));
    return Json::object({{"styles", std::move(styles)},
                         {"ray_cast_weight", Json::of(layer.ray_cast_weight)},
                         {"slice_opacity", Json::of(layer.slice_opacity)},
                         {"outline_px", Json::of(layer.outline_px)}});
}

Json surfaces_json(const SceneFile& file) {
    Json surfaces = Json::array();
    for (size_t i = 0; i < file.scene.surfaces.size(); ++i) {
        const SurfaceSource source = i < file.surfaces.size() ? file.surfaces[i] : SurfaceSource{};
        const SurfaceLayer& layer = file.scene.surfaces[i];
        Json out = Json::object();
        if (source.iso)
            out.members.emplace_back("iso", Json::of(*source.iso));
        else if (source.labels)
            out.members.emplace_back("labels", Json::of(true));
        else
            out.members.emplace_back("mesh", Json::of(source.mesh));
        if (layer.live_iso)
            out.members.emplace_back("live", Json::of(true));
        out.members.emplace_back("color", vector_json(layer.style.color));
        out.members.emplace_back("opacity", Json::of(layer.style.opacity));
        out.members.emplace_back("shading", shading_json(layer.shading));
        out.members.emplace_back("smooth", Json::of(layer.smooth));
        Json styles = Json::array();
        for (size_t label = 1; label < layer.label_styles.size(); ++label)
            styles.items.push_back(
                Json::object({{"label", Json::of(static_cast<double>(label))},
                              {"color", vector_json(layer.label_styles[label].color)},
                              {"opacity", Json::of(layer.label_styles[label].opacity)}}));
        out.members.emplace_back("styles", std::move(styles));
        surfaces.items.push_back(std::move(out));
    }
    return surfaces;
}

} // namespace

std::string write_scene(const SceneFile& file) {
    const Scene& scene = file.scene;
    Json out = Json::object();
    const auto add = [&](const char* key, Json value) {
        out.members.emplace_back(key, std::move(value));
    };
    add("volume", Json::of(file.volume));
    if (!file.labels.empty())
        add("labels", Json::of(file.labels));
    add("frame", Json::of(static_cast<double>(file.frame)));
    if (!file.series.empty())
        add("series", Json::of(file.series));
    if (file.resample_slices)
        add("resample_slices", Json::of(true));
    add("size_px", Json::array({Json::of(static_cast<double>(scene.size_px.x)),
                                Json::of(static_cast<double>(scene.size_px.y))}));
    add("background", vector_json(scene.background));
    add("camera", camera_json(file));
    if (scene.stereo) {
        Json stereo =
            Json::object({{"layout", name_json(scene.stereo->layout)},
                          {"eye_separation_mm", Json::of(scene.stereo->rig.eye_separation_mm)},
                          {"convergence_mm", Json::of(scene.stereo->rig.convergence_mm)}});
        if (scene.stereo->swap_eyes)
            stereo.members.emplace_back("swap_eyes", Json::of(true));
        add("stereo", std::move(stereo));
    }
    if (scene.mirror)
        add("mirror", Json::of(true));
    if (scene.ray_cast)
        add("ray_cast", ray_cast_json(*scene.ray_cast));
    add("slices", slices_json(file));
    if (!scene.slice_transfer.colors.empty())
        add("slice_transfer", transfer_function_json(scene.slice_transfer));
    add("clip_planes", clip_planes_json(file));
    if (scene.labels)
        add("label_layer", label_layer_json(*scene.labels));
    if (!scene.surfaces.empty()) {
        add("surfaces", surfaces_json(file));
        add("surface_depth", Json::of(static_cast<double>(scene.surface_depth)));
    }
    add("value_and_depth", Json::of(scene.value_and_depth));
    return json_text(out);
}

std::string scene_hash(const SceneFile& file) {
    uint64_t hash = 14695981039346656037u; // FNV-1a
    for (const char c : write_scene(file))
        hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return fmt::format("{:016x}", hash);
}

} // namespace palpate
