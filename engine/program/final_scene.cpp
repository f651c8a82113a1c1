// The options applied to a scene whose volumes are loaded.

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/io/x3d.h"
#include "engine/program/option_texts.h"
#include "engine/program/scene_options.h"
#include "engine/program/surface_labels.h"
#include "engine/scene/presets.h"
#include "engine/session/bright_background.h"
#include "engine/session/default_scene.h"

namespace palpate {

namespace {

void apply_slices(const SceneOptions& options, const Grid& grid, Scene& scene) {
    if (!options.slices.empty())
        scene.slices.clear();
    for (const std::string& text : options.slices)
        scene.slices.push_back(read_slice(text, center_mm(grid)).value());
    for (SliceLayer& slice : scene.slices) {
        slice.interpolation = options.interpolation.value_or(slice.interpolation);
        slice.slab_mode = options.slab_mode.value_or(slice.slab_mode);
        options.slice_settings.apply(slice);
    }
}

Result<void> apply_clips(const SceneOptions& options, Scene& scene) {
    for (const std::string& text : options.clips)
        scene.clip_planes.push_back(read_clip(text).value());
    if (scene.clip_planes.size() > kMaxClipPlanes)
        return fail("{}: expected at most {} planes, found {}", Option{"clip"}, kMaxClipPlanes,
                    scene.clip_planes.size());
    return {};
}

bool has_transfer(const SceneOptions& options) {
    return !options.window.empty() || !options.window_level.empty() ||
           !options.window_preset.empty() || !options.transfer.empty();
}

Result<TransferFunction> load_transfer(Option option, const std::string& name, const Grid& grid) {
    if (name.starts_with('{')) {
        PALPATE_TRY(TransferFunction read, parse_transfer_function(name, text_of(option)));
        return sized(std::move(read), grid);
    }
    std::error_code error;
    if (!std::filesystem::exists(name, error))
        return fail("{}: expected a preset ({}) or a JSON file, found '{}'", option,
                    fmt::join(preset_names(), ", "), name);
    Result<TransferFunction> read = load_transfer_function(name);
    return read ? sized(*read, grid) : read;
}

Result<TransferFunction> transfer_of(const SceneOptions& options, const LoadedScene& loaded,
                                     RayMode mode) {
    const Grid& grid = loaded.data.volume.grid();
    const double max_opacity = mode == RayMode::mip ? 1.0 : 0.1;
    const auto ends = [&](double low, double high) {
        const TransferFunction grey = window_function(low, high, max_opacity, preset_unit_mm(grid));
        return loaded.inverted ? mirrored(grey) : grey;
    };
    if (!options.window.empty())
        return ends(options.window[0], options.window[1]);
    const auto window = [&](double level, double width) {
        return ends(level - 0.5 * width, level + 0.5 * width);
    };
    if (!options.window_level.empty())
        return window(options.window_level[0], options.window_level[1]);
    for (const WindowPreset& preset : window_presets())
        if (options.window_preset == preset.name) {
            if (!loaded.modality.empty() && loaded.modality != "CT")
                return fail("{} {}: expected a CT, found modality {}", Option{"window-preset"},
                            preset.name, loaded.modality);
            return window(zero_hu(loaded) + preset.level, preset.width);
        }
    if (const auto found = preset(options.transfer))
        return fitted(*found, options.transfer, loaded);
    return load_transfer({"tf"}, options.transfer, grid);
}

Result<void> apply_fusion(const SceneOptions& options, const LoadedScene& loaded, Scene& scene) {
    if (!scene.fusion || !loaded.data.fused)
        return {};
    TransferFunction& transfer = scene.fusion->transfer;
    const ValueRange range = loaded.data.fused->range();
    if (options.fused_transfer.empty()) {
        if (transfer.colors.empty())
            transfer = default_fusion_transfer(range);
        return {};
    }
    const Grid& grid = loaded.data.fused->grid();
    const auto found = preset(options.fused_transfer);
    Result<TransferFunction> read =
        found ? sized(*found, grid) : load_transfer({"fused-tf"}, options.fused_transfer, grid);
    if (!read)
        return pass_on(read);
    transfer = options.fused_transfer == "mr" && range.min < range.max
                   ? stretched(*read, range.min, range.max)
                   : *read;
    return {};
}

Result<void> apply_ray_cast(const SceneOptions& options, const LoadedScene& loaded, Scene& scene) {
    const bool wanted = options.mode || !options.isos.empty();
    if (!wanted && !scene.ray_cast)
        return {};
    const RayMode mode =
        options.mode.value_or(scene.ray_cast ? scene.ray_cast->mode : RayMode::iso);
    if (!scene.ray_cast || scene.ray_cast->mode != mode)
        scene.ray_cast = default_ray_cast(mode, loaded);
    RayCastLayer& layer = *scene.ray_cast;
    layer.integrator = options.integrator.value_or(layer.integrator);
    if (has_transfer(options)) {
        PALPATE_TRY(layer.transfer, transfer_of(options, loaded, mode));
    }
    if (!options.isos.empty())
        layer.isos = iso_surfaces(options.isos);
    options.ray_cast_settings.apply(layer);
    if (options.jitter_seed)
        layer.jitter_seed = options.jitter_seed;
    if (options.shade)
        layer.shading = Shading{};
    if (options.no_shade)
        layer.shading.reset();
    if (!options.light.empty())
        layer.light = Light{options.light[0], options.light[1]};
    return {};
}

Result<void> apply_camera(const SceneOptions& options, const Grid& grid, Scene& scene) {
    const bool sets_distance = (options.fill || options.view_angle_deg) &&
                               scene.camera.projection == Projection::perspective;
    if (!options.camera.empty()) {
        const auto& v = options.camera;
        scene.camera.eye_mm = {v[0], v[1], v[2]};
        scene.camera.target_mm = {v[3], v[4], v[5]};
        if (v.size() == 9)
            scene.camera.up = {v[6], v[7], v[8]};
        scene.camera.view_angle_deg = options.view_angle_deg.value_or(30.0);
        const glm::dvec3 forward = scene.camera.target_mm - scene.camera.eye_mm;
        if (!(glm::length(glm::cross(forward, scene.camera.up)) > 1e-9 * glm::length(forward)))
            return fail(
                "{}: expected a target that differs from the eye, and an up vector that is "
                "not parallel to the view direction",
                Option{"camera"});
    } else if (!options.view.empty() || (sets_distance && !has_scene(options.input))) {
        const std::optional<ViewDirection> view =
            view_direction(options.view.empty() ? "oblique" : options.view);
        scene.camera = frame_volume(grid, view->towards, view->up, options.fill.value_or(0.8),
                                    options.view_angle_deg.value_or(30.0));
    } else if (options.view_angle_deg) {
        scene.camera.view_angle_deg = *options.view_angle_deg;
    }
    scene.camera.projection = options.projection.value_or(scene.camera.projection);
    return {};
}

void apply_display(const SceneOptions& options, Scene& scene) {
    if (options.stereo && !scene.stereo) {
        // A comfortable pair: the eyes converge on the target, 1/30 of the distance apart.
        const double distance = glm::length(scene.camera.target_mm - scene.camera.eye_mm);
        scene.stereo = StereoSettings{{distance / 30.0, distance}, *options.stereo};
    }
    if (options.stereo)
        scene.stereo->layout = *options.stereo;
    if (scene.stereo && options.swap_eyes)
        scene.stereo->swap_eyes = true;
    scene.mirror = scene.mirror || options.mirror;
    if (scene.stereo && options.eye_separation_mm > 0)
        scene.stereo->rig.eye_separation_mm = options.eye_separation_mm;
    if (scene.stereo && options.convergence_mm > 0)
        scene.stereo->rig.convergence_mm = options.convergence_mm;
}

bool asks_for_nothing(const SceneOptions& o) {
    return o.slices.empty() && !o.mode && o.isos.empty() && o.surfaces.empty();
}

} // namespace

bool fill_counts(const SceneOptions& options, const SceneFile& file, const Scene& scene) {
    if (!options.camera.empty() || !options.view.empty())
        return options.camera.empty();
    return has_scene(options.input) ? file.framing.has_value()
                                    : scene.ray_cast || scene.slices.size() != 1;
}

void show_labels_by_default(const SceneOptions& options, SceneFile& file, LoadedScene& loaded) {
    const Scene& scene = file.scene;
    if (scene.ray_cast || !scene.slices.empty() || !scene.surfaces.empty() ||
        !file.labels.empty() || !asks_for_nothing(options) || has_transfer(options) ||
        !is_label_map(loaded))
        return;
    log::info(
        "{}: a label map, by its values, so the surfaces of its labels are drawn ({} "
        "alpha draws its numbers)",
        file.volume, Option{"mode"});
    file.labels = file.volume;
    file.surfaces = {SurfaceSource{.mesh = {}, .iso = {}, .labels = true}};
    file.scene.surfaces = {SurfaceLayer{}};
    file.scene.labels = LabelLayer{};
    loaded.data.labels = loaded.data.volume;
}

Result<void> hide_other_labels(const SceneOptions& options, SceneFile& file,
                               const LoadedScene& loaded) {
    if (options.only_labels.empty())
        return {};
    if (!loaded.data.labels || !file.scene.labels)
        return fail("{}: expected a label map ({}), found none", Option{"only-label"},
                    Option{"labels"});
    const std::map<uint16_t, uint64_t> counts = count_labels(*loaded.data.labels);
    std::set<uint32_t> shown;
    PALPATE_TRY(const std::vector<uint16_t> labels, [&]() -> Result<std::vector<uint16_t>> {
        Result<std::vector<uint16_t>> named = labels_named(options.only_labels, loaded.label_names);
        if (!named)
            return fail("{}: {}", Option{"only-label"}, named.error().message);
        return named;
    }());
    for (size_t i = 0; i < labels.size(); ++i) {
        if (labels[i] == 0 || !counts.contains(labels[i]))
            return fail("{} {}: no sample of the label map has the label {}", Option{"only-label"},
                        options.only_labels[i], labels[i]);
        shown.insert(labels[i]);
    }
    const uint32_t last = counts.rbegin()->first;
    std::vector<LabelStyle>& styles = file.scene.labels->styles;
    for (uint32_t label = static_cast<uint32_t>(styles.size()); label <= last; ++label)
        styles.push_back(style_of(LabelLayer{}, label));
    for (uint32_t label = 1; label < styles.size(); ++label)
        styles[label].visible = shown.contains(label);
    for (size_t i = 0; i < std::min(file.surfaces.size(), file.scene.surfaces.size()); ++i) {
        SurfaceLayer& layer = file.scene.surfaces[i];
        if (!file.surfaces[i].labels)
            continue;
        std::vector<SurfaceStyle> all;
        for (uint32_t label = 0; label <= last; ++label)
            all.push_back(style_of(layer, label));
        for (uint32_t label = 1; label <= last; ++label)
            if (!shown.contains(label))
                all[label].opacity = 0.0;
        layer.label_styles = std::move(all);
    }
    return {};
}

Result<Scene> final_scene(const SceneOptions& options, SceneFile file, const LoadedScene& loaded) {
    const Grid& grid = loaded.data.volume.grid();
    const bool own_surfaces = file.scene.surfaces.empty() || !options.surfaces.empty();
    const bool from_volume = !file.scene.ray_cast && file.scene.slices.empty() && own_surfaces;
    if (file.framing) {
        file.framing->fill = options.fill.value_or(file.framing->fill);
        file.framing->view_angle_deg =
            options.view_angle_deg.value_or(file.framing->view_angle_deg);
    }
    Scene scene = resolved_scene(file, grid);
    const std::optional<RayCastLayer> given = scene.ray_cast;
    if (is_x3d_file(options.input)) { // it names no transfer function, and maybe no iso-value
        RayCastLayer layer = default_ray_cast(scene.ray_cast->mode, loaded);
        if (!scene.ray_cast->isos.empty())
            layer.isos = scene.ray_cast->isos;
        scene.ray_cast = std::move(layer);
    }
    if (options.size_px.size() == 2)
        scene.size_px = {options.size_px[0], options.size_px[1]};
    if (!options.background.empty())
        scene.background = read_background(options.background).value();
    scene.value_and_depth = scene.value_and_depth || options.values;
    const bool nothing_asked = from_volume && asks_for_nothing(options);
    const std::optional<SliceLayer> plane = nothing_asked ? only_slice(grid) : std::nullopt;
    if (plane) {
        log::info("{}: one sample thick, so it is drawn as a slice ({} alpha draws a volume)",
                  file.volume, Option{"mode"});
        scene.slices = {*plane};
    } else if (nothing_asked) {
        scene.ray_cast = default_ray_cast(RayMode::alpha, loaded);
    }
    const ValueRange range = loaded.data.volume.range();
    if (nothing_asked && !(range.min < range.max))
        log::warning(
            "{}: {}, so there is nothing to see", file.volume,
            range.empty() ? "no sample has data" : fmt::format("all samples are {:g}", range.min));
    PALPATE_TRY(apply_ray_cast(options, loaded, scene));
    PALPATE_TRY(apply_fusion(options, loaded, scene));
    apply_slices(options, grid, scene);
    if (!scene.slices.empty() && scene.slice_transfer.colors.empty())
        scene.slice_transfer = default_slice_transfer(loaded);
    if (!scene.slices.empty() && has_transfer(options)) {
        PALPATE_TRY(scene.slice_transfer, transfer_of(options, loaded, RayMode::mip));
    }
    if (!has_scene(options.input))
        scene.camera = default_camera(scene, loaded.data);
    PALPATE_TRY(apply_clips(options, scene));
    PALPATE_TRY(apply_camera(options, grid, scene));
    apply_display(options, scene);
    const bool chosen = scene.ray_cast && scene.ray_cast->mode != RayMode::iso &&
                        !has_transfer(options) && (!given || given->mode != scene.ray_cast->mode);
    if (const std::string told = chosen ? told_of_bright_background(loaded) : ""; !told.empty())
        log::info("{}: {}", file.volume, told);
    return scene;
}

} // namespace palpate
