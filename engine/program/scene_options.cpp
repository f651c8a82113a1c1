#include "engine/program/scene_options.h"

#include <fmt/ranges.h>
#include <cmath>

#include <algorithm>
#include <filesystem>
#include <map>
#include <tuple>

#include "engine/base/option_name.h"
#include "engine/io/x3d.h"
#include "engine/program/option_checks.h"
#include "engine/program/option_texts.h"
#include "engine/program/project_input.h"
#include "engine/program/setting_options.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_names.h"
#include "engine/scene/scene_settings.h"
#include "engine/session/default_scene.h"

namespace palpate {

namespace {

// The values of an enum by the names that scene files give them.
template <class Enum>
CLI::Validator named() {
    return one_of(std::map<std::string, Enum>(Names<Enum>::list.begin(), Names<Enum>::list.end()));
}

// Names of presets in upper case, too, as 3D Slicer writes its own.
CLI::Validator preset_in_any_case() {
    return CLI::Validator(
        [](std::string& text) {
            if (const std::string name = CLI::detail::to_lower(text); preset(name))
                text = name;
            return std::string();
        },
        "");
}

// The surfaces of the options replace those of the file.
Result<void> apply_surfaces(const SceneOptions& options, SceneFile& file) {
    if (!options.surfaces.empty()) {
        file.surfaces.clear();
        file.scene.surfaces.clear();
    }
    for (const std::string& text : options.surfaces) {
        Result<SurfaceSource> source = read_surface(text);
        if (source->labels && file.labels.empty())
            return fail("{} labels: expected a label map ({}), found none", Option{"surface"},
                        Option{"labels"});
        SurfaceLayer layer;
        layer.style.color = surface_color(file.surfaces.size());
        file.surfaces.push_back(std::move(*source));
        file.scene.surfaces.push_back(layer);
    }
    const size_t count = file.scene.surfaces.size();
    if (options.surface_colors.size() > count || options.surface_opacities.size() > count)
        return fail("{}, {}: expected at most one for each {}, found {}", Option{"surface-color"},
                    Option{"surface-opacity"}, Option{"surface"},
                    std::max(options.surface_colors.size(), options.surface_opacities.size()));
    for (size_t i = 0; i < options.surface_colors.size(); ++i)
        file.scene.surfaces[i].style.color = read_color(options.surface_colors[i]).value();
    for (size_t i = 0; i < options.surface_opacities.size(); ++i)
        file.scene.surfaces[i].style.opacity = options.surface_opacities[i];
    options.scene_settings.apply(file.scene);
    return {};
}

// Checks the options whatever the scene: several values, or one option in all.
Result<void> check_together(const SceneOptions& o) {
    for (const auto& [option, most, found] : {std::tuple("slice", kMaxSlices, o.slices.size()),
                                              {"clip", kMaxClipPlanes, o.clips.size()},
                                              {"surface", kMaxSurfaces, o.surfaces.size()},
                                              {"iso", kMaxIsos, o.isos.size()}})
        if (found > most)
            return fail("{}: expected at most {}, found {}", Option{option}, most, found);
    if (!o.window.empty() && !(o.window[0] < o.window[1]))
        return fail("{}: expected LOW below HIGH, found {:g},{:g}; {} takes LEVEL,WIDTH",
                    Option{"window"}, o.window[0], o.window[1], Option{"window-level"});
    if (!o.window_level.empty() && !(o.window_level[1] > 0.0))
        return fail("{}: expected a WIDTH above 0, found {:g}", Option{"window-level"},
                    o.window_level[1]);
    for (size_t i = 0; i < o.light.size(); ++i)
        if (const Setting<Light>& angle = kLightSettings[i]; !allows(angle, o.light[i]))
            return fail("{}: expected an {} from {} to {} {}, found {:g}", Option{"light"},
                        i == 0 ? "azimuth" : "elevation", angle.least, angle.most, angle.unit,
                        o.light[i]);
    const auto& v = o.camera;
    if (!v.empty() && v.size() != 6 && v.size() != 9)
        return fail("{}: expected 6 or 9 numbers, found {}", Option{"camera"}, v.size());
    if (!v.empty() && v[0] == v[3] && v[1] == v[4] && v[2] == v[5])
        return fail("{}: expected a target that differs from the eye, found both at {:g},{:g},{:g}",
                    Option{"camera"}, v[0], v[1], v[2]);
    return {};
}

void add_inputs(CLI::App& app, SceneOptions& o) {
    app.add_option("SCENE", o.input,
                   "Scene file (.json), project folder, or a volume: file, DICOM folder, slice "
                   "pattern, synthetic:NAME")
        ->required();
    app.add_option(
           "--volume", o.volume,
           "With a scene file: another volume in the place of its own, as of another patient; "
           "--labels likewise (default: the scene's)")
        ->type_name("FILE");
    app.add_option("--labels", o.labels, "Label map shown with the volume (default: none)")
        ->type_name("FILE");
    app.add_option("--label-names", o.label_names,
                   "Names and colours of the labels: a table of ITK-SNAP, 3D Slicer or FreeSurfer "
                   "(default: those in the label map's file)")
        ->type_name("FILE");
    app.add_option("--only-label", o.only_labels,
                   "Show this label alone, by number or name; repeatable (default: all)")
        ->type_name("LABEL");
    CLI::Option* fused =
        app.add_option("--fused", o.fused,
                       "Another volume, shown in colour over slices, with its own grid (default: "
                       "none)")
            ->type_name("FILE");
    app.add_option(
           "--fused-tf", o.fused_transfer,
           "Colours and opacities of --fused: a preset, a JSON file or its text (default: black, "
           "red, yellow, white over its values)")
        ->transform(preset_in_any_case())
        ->needs(fused);
    add_settings<FusionLayer>(app, o.fusion_settings, kFusionSettings);
    app.get_option("--fused-opacity")->needs(fused);
    app.add_option("--overlay", o.overlay, "A second label map, shown over slices (default: none)")
        ->type_name("FILE");
}

void add_ray_options(CLI::App& app, SceneOptions& o) {
    app.add_option("--mode", o.mode,
                   "Ray-casting mode (default: alpha; no ray casting with --slice alone; surfaces "
                   "for a label map; a slice for a volume one sample thick)")
        ->transform(named<RayMode>());
    app.add_option("--iso", o.isos,
                   "Iso-values, in the volume's units (default: 300 HU for CT, else chosen from "
                   "the values)")
        ->delimiter(',');
    CLI::Option* transfer = app.add_option(
        "--tf", o.transfer,
        fmt::format("Transfer function: a preset ({}), a JSON file, or its text (default: "
                    "chosen from modality and values, see docs/reference/scene.md)",
                    fmt::join(preset_names(), ", ")));
    transfer->transform(preset_in_any_case());
    CLI::Option* window =
        app.add_option(
               "--window", o.window,
               "Grey ramp from LOW to HIGH, in the volume's units, instead of --tf; white at "
               "LOW for a DICOM MONOCHROME1")
            ->delimiter(',')
            ->expected(2)
            ->excludes(transfer);
    app.add_option(
           "--window-level", o.window_level,
           "Window by LEVEL,WIDTH: LEVEL - WIDTH/2 to LEVEL + WIDTH/2, in the volume's units")
        ->delimiter(',')
        ->expected(2)
        ->excludes(transfer)
        ->excludes(window);
    std::vector<std::string> windows;
    for (const WindowPreset& preset : window_presets())
        windows.push_back(preset.name);
    CLI::Option* tissue =
        app.add_option(
               "--window-preset", o.window_preset,
               "A radiologist's window for this part of a CT, by name (docs/reference/scene.md)")
            ->check(one_of(windows));
    for (const char* other : {"--tf", "--window", "--window-level"})
        tissue->excludes(app.get_option(other));
    app.add_option("--integrator", o.integrator, "Integrator of the rays (default: fast)")
        ->transform(named<Integrator>());
    add_settings<RayCastLayer>(app, o.ray_cast_settings, kRayCastSettings);
    app.add_option("--jitter", o.jitter_seed,
                   "fast, preintegrated: shift each ray's samples by a random share of a step, a "
                   "hash of its pixel and this seed (default: none)");
    CLI::Option* shade =
        app.add_flag("--shade", o.shade, "Shade by the gradient (default: on for alpha and iso)");
    app.add_flag("--no-shade", o.no_shade, "Alpha: no gradient shading")->excludes(shade);
    app.add_option(
           "--light", o.light,
           "Alpha and iso: light from azimuth (to the right) and elevation (up), in degrees "
           "in the camera's frame, such as -30,45; it casts no shadows (default: at the "
           "eye)")
        ->delimiter(',')
        ->expected(2)
        ->type_name("AZIMUTH,ELEVATION");
}

void add_slice_options(CLI::App& app, SceneOptions& o) {
    app.add_option("--slice", o.slices,
                   "A slice: axial, coronal or sagittal, with :MM for its position in mm (LPS), or "
                   "point and normal px,py,pz,nx,ny,nz (default position: the centre); repeatable")
        ->check(readable([](const std::string& text) { return read_slice(text); }));
    app.add_option("--interpolation", o.interpolation, "Interpolation in slices (default: linear)")
        ->transform(named<Interpolation>());
    add_settings<SliceLayer>(app, o.slice_settings, kSliceSettings);
    app.add_option("--slab-mode", o.slab_mode, "How a slab combines its samples (default: mean)")
        ->transform(named<SlabMode>());
}

void add_surface_options(CLI::App& app, SceneOptions& o) {
    app.add_option(
           "--surface", o.surfaces,
           "A mesh in the picture: a PLY, STL, OBJ or VTP file, iso=VALUE for the volume's surface "
           "at that value, or labels for the surfaces of the label map; repeatable (default: none)")
        ->check(readable(read_surface))
        ->type_name("SOURCE");
    app.add_option("--surface-color", o.surface_colors,
                   "Colours of the surfaces, in their order: r,g,b, 0 .. 1; repeatable (default: "
                   "bone, skin, ..)")
        ->check(readable(read_color));
    app.add_option(
           "--surface-opacity", o.surface_opacities,
           "Opacities of the surfaces, in their order: 0 .. 1, separated by commas (default: 1)")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 1.0));
    add_settings<Scene>(app, o.scene_settings, kSceneSettings);
    app.add_option("--clip", o.clips,
                   "Clip plane by point and normal, px,py,pz,nx,ny,nz in mm (LPS); the side of the "
                   "normal is kept; repeatable")
        ->check(readable(read_clip));
}

void add_camera_options(CLI::App& app, SceneOptions& o) {
    app.add_option("--view", o.view,
                   fmt::format("Camera: {} (default: oblique)", fmt::join(view_names(), ", ")))
        ->check(one_of(view_names()));
    app.add_option("--fill", o.fill, "Distance of --view; below 1 is closer (default: 0.8)")
        ->check(positive());
    app.add_option("--view-angle", o.view_angle_deg,
                   "Perspective: angle from bottom to top in degrees (default: 30)")
        ->check(CLI::Range(0.001, 179.0));
    app.add_option("--camera", o.camera,
                   "Camera: eye and target in mm (LPS), and up: ex,ey,ez,tx,ty,tz[,ux,uy,uz]")
        ->delimiter(',');
    app.add_option("--projection", o.projection, "Camera (default: perspective)")
        ->transform(named<Projection>());
    app.add_option("--size", o.size_px, "Width and height in pixels (default: 512,512)")
        ->delimiter(',')
        ->expected(2)
        ->check(CLI::Range(1, 16384));
    app.add_option("--stereo", o.stereo, "Stereo layout (default: one eye)")
        ->transform(named<StereoLayout>());
    app.add_option("--eye-separation", o.eye_separation_mm,
                   "Stereo: mm between the eyes (default: 1/30 of the distance)")
        ->check(positive());
    app.add_option("--convergence", o.convergence_mm,
                   "Stereo: convergence distance in mm (default: that of the target)")
        ->check(positive());
    app.add_flag("--swap-eyes", o.swap_eyes, "Stereo: show each eye in place of the other");
    app.add_flag("--mirror", o.mirror,
                 "Turn the picture upside down, for a screen that is seen in a mirror");
    app.add_option("--background", o.background,
                   "black, white, transparent (alpha in the picture), or a colour r,g,b, 0 .. 1 "
                   "(default: black)")
        ->check(readable(read_background))
        ->type_name("COLOR");
    app.add_flag("--values", o.values,
                 "EXR: also write value and depth in mm (default: colours only)");
}

} // namespace

bool is_scene_file(const std::string& input) {
    return input.ends_with(".json") && !is_synthetic(input) && !Project::is_one(input);
}

bool has_scene(const std::string& input) {
    return is_scene_file(input) || is_x3d_file(input) || Project::is_one(input);
}

void add_scene_options(CLI::App& app, SceneOptions& o) {
    add_inputs(app, o);
    add_ray_options(app, o);
    add_slice_options(app, o);
    add_surface_options(app, o);
    add_camera_options(app, o);
    refuse_where_wrong(app, [&o] { return check_together(o); });
}

Result<SceneFile> base_scene(const SceneOptions& options) {
    PALPATE_TRY(SceneFile file, scene_file_of(options.input));
    if (!has_scene(options.input))
        file.framing = Framing{};
    const auto take = [](const std::string& named, std::string& in_file, auto& layer) {
        if (named.empty())
            return;
        in_file = is_synthetic(named) ? named : std::filesystem::absolute(named).string();
        if (!layer)
            layer.emplace();
    };
    if (!options.volume.empty()) {
        if (!has_scene(options.input) || Project::is_one(options.input))
            return fail("{}: expected a scene file, whose volume it replaces, found {}",
                        Option{"volume"}, options.input);
        file.volume = is_synthetic(options.volume)
                          ? options.volume
                          : std::filesystem::absolute(options.volume).string();
    }
    take(options.labels, file.labels, file.scene.labels);
    take(options.fused, file.fused, file.scene.fusion);
    take(options.overlay, file.overlay, file.scene.overlay);
    if (file.scene.fusion)
        options.fusion_settings.apply(*file.scene.fusion);
    if (!options.background.empty())
        file.transparent = options.transparent();
    PALPATE_TRY(apply_surfaces(options, file));
    return file;
}

std::optional<StereoLayout> stereo_layout(const SceneOptions& options, const Scene& scene) {
    return options.stereo ? options.stereo
           : scene.stereo ? std::optional(scene.stereo->layout)
                          : std::nullopt;
}

} // namespace palpate
