#include "apps/palpate/scene_options.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>

#include "apps/palpate/default_scene.h"
#include "apps/palpate/option_checks.h"
#include "engine/base/log.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

// The values of an enum by the names that scene files give them.
template <class Enum>
CLI::Validator named() {
    return one_of(std::map<std::string, Enum>(Names<Enum>::list.begin(), Names<Enum>::list.end()));
}

Result<std::vector<double>> numbers(const char* option, const std::string& text, size_t count) {
    std::vector<double> values;
    const char* at = text.data();
    const char* end = at + text.size();
    while (at < end) {
        double value = 0;
        const auto [next, error] = std::from_chars(at, end, value);
        if (error != std::errc() || !std::isfinite(value) || (next < end && *next != ','))
            break;
        values.push_back(value);
        at = next < end ? next + 1 : next;
        if (next == end)
            break;
    }
    if (at != end || values.size() != count)
        return fail("{}: expected {} numbers separated by commas, found '{}'", option, count, text);
    return values;
}

// "axial", "coronal:-12.5", or "px,py,pz,nx,ny,nz".
Result<SliceLayer> slice_of(const std::string& text, const Grid& grid) {
    SliceLayer slice;
    slice.point_mm = center_mm(grid);
    constexpr std::pair<const char*, int> planes[] = {
        {"sagittal", 0}, {"coronal", 1}, {"axial", 2}};
    for (const auto& [name, axis] : planes) {
        if (!text.starts_with(name))
            continue;
        slice.normal = glm::dvec3(0.0);
        slice.normal[axis] = 1.0;
        const std::string rest = text.substr(std::string_view(name).size());
        if (rest.empty())
            return slice;
        if (rest.front() != ':')
            break;
        const Result<std::vector<double>> at = numbers("--slice", rest.substr(1), 1);
        if (!at)
            return fail("{}", at.error().message);
        slice.point_mm[axis] = at->front();
        return slice;
    }
    const Result<std::vector<double>> v = numbers("--slice", text, 6);
    if (!v)
        return fail(
            "--slice: expected axial, coronal or sagittal, with :MM if wanted, or "
            "px,py,pz,nx,ny,nz; found '{}'",
            text);
    slice.point_mm = {(*v)[0], (*v)[1], (*v)[2]};
    slice.normal = {(*v)[3], (*v)[4], (*v)[5]};
    if (glm::length(slice.normal) == 0.0)
        return fail("--slice: expected a normal that is not 0, found '{}'", text);
    return slice;
}

Result<void> apply_slices(const SceneOptions& options, const Grid& grid, Scene& scene) {
    if (!options.slices.empty())
        scene.slices.clear();
    for (const std::string& text : options.slices) {
        Result<SliceLayer> slice = slice_of(text, grid);
        if (!slice)
            return fail("{}", slice.error().message);
        scene.slices.push_back(*slice);
    }
    if (scene.slices.size() > kMaxSlices)
        return fail("--slice: expected at most {} slices, found {}", kMaxSlices,
                    scene.slices.size());
    for (SliceLayer& slice : scene.slices) {
        slice.interpolation = options.interpolation.value_or(slice.interpolation);
        slice.slab_mode = options.slab_mode.value_or(slice.slab_mode);
        if (options.slab_mm > 0)
            slice.slab_mm = options.slab_mm;
    }
    return {};
}

Result<void> apply_clips(const SceneOptions& options, Scene& scene) {
    for (const std::string& text : options.clips) {
        const Result<std::vector<double>> v = numbers("--clip", text, 6);
        if (!v)
            return fail("{}", v.error().message);
        const glm::dvec3 normal((*v)[3], (*v)[4], (*v)[5]);
        if (glm::length(normal) == 0.0)
            return fail("--clip: expected a normal that is not 0, found '{}'", text);
        scene.clip_planes.push_back({{(*v)[0], (*v)[1], (*v)[2]}, normal});
    }
    if (scene.clip_planes.size() > kMaxClipPlanes)
        return fail("--clip: expected at most {} planes, found {}", kMaxClipPlanes,
                    scene.clip_planes.size());
    return {};
}

// "labels", "iso=300" or a file.
Result<SurfaceSource> surface_of(const std::string& text) {
    if (text == "labels")
        return SurfaceSource{.mesh = {}, .iso = {}, .labels = true};
    if (text.starts_with("iso=")) {
        const Result<std::vector<double>> value = numbers("--surface iso=", text.substr(4), 1);
        if (!value)
            return fail("{}", value.error().message);
        return SurfaceSource{.mesh = {}, .iso = (*value)[0], .labels = false};
    }
    return SurfaceSource{.mesh = std::filesystem::absolute(text).string(), .iso = {}};
}

// The surfaces of the options replace those of the file.
Result<void> apply_surfaces(const SceneOptions& options, SceneFile& file) {
    if (options.surfaces.size() > kMaxSurfaces)
        return fail("--surface: expected at most {} surfaces, found {}", kMaxSurfaces,
                    options.surfaces.size());
    if (!options.surfaces.empty()) {
        file.surfaces.clear();
        file.scene.surfaces.clear();
    }
    for (const std::string& text : options.surfaces) {
        Result<SurfaceSource> source = surface_of(text);
        if (!source)
            return fail("{}", source.error().message);
        if (source->labels && file.labels.empty())
            return fail("--surface labels: expected a label map (--labels), found none");
        SurfaceLayer layer;
        layer.style.color = surface_color(file.surfaces.size());
        file.surfaces.push_back(std::move(*source));
        file.scene.surfaces.push_back(layer);
    }
    const size_t count = file.scene.surfaces.size();
    if (options.surface_colors.size() > count || options.surface_opacities.size() > count)
        return fail("--surface-color, --surface-opacity: expected at most one a surface, found {}",
                    std::max(options.surface_colors.size(), options.surface_opacities.size()));
    for (size_t i = 0; i < options.surface_colors.size(); ++i) {
        const auto c = numbers("--surface-color", options.surface_colors[i], 3);
        if (!c)
            return fail("{}", c.error().message);
        if (!std::all_of(c->begin(), c->end(), [](double v) { return v >= 0.0 && v <= 1.0; }))
            return fail("--surface-color: expected numbers from 0 to 1, found '{}'",
                        options.surface_colors[i]);
        file.scene.surfaces[i].style.color = {(*c)[0], (*c)[1], (*c)[2]};
    }
    for (size_t i = 0; i < options.surface_opacities.size(); ++i)
        file.scene.surfaces[i].style.opacity = options.surface_opacities[i];
    if (options.surface_depth > 0)
        file.scene.surface_depth = options.surface_depth;
    return {};
}

bool has_transfer(const SceneOptions& options) {
    return !options.window.empty() || !options.window_level.empty() || !options.transfer.empty();
}

Result<TransferFunction> transfer_of(const SceneOptions& options, const LoadedScene& loaded,
                                     RayMode mode) {
    const Grid& grid = loaded.data.volume.grid();
    const double max_opacity = mode == RayMode::mip ? 1.0 : 0.1;
    if (!options.window.empty()) {
        const double low = options.window[0], high = options.window[1];
        if (!(low < high))
            return fail(
                "--window: expected LOW below HIGH, found {:g},{:g}; --window-level takes "
                "LEVEL,WIDTH",
                low, high);
        return window_function(low, high, max_opacity, preset_unit_mm(grid));
    }
    if (!options.window_level.empty()) {
        const double level = options.window_level[0], width = options.window_level[1];
        if (!(width > 0.0))
            return fail("--window-level: expected a WIDTH above 0, found {:g}", width);
        return window_function(level - 0.5 * width, level + 0.5 * width, max_opacity,
                               preset_unit_mm(grid));
    }
    if (const auto found = preset(options.transfer))
        return fitted(*found, options.transfer, loaded);
    std::error_code error;
    if (!std::filesystem::exists(options.transfer, error))
        return fail("--tf: expected a preset ({}) or a JSON file, found '{}'",
                    fmt::join(preset_names(), ", "), options.transfer);
    Result<TransferFunction> read = load_transfer_function(options.transfer);
    return read ? sized(*read, grid) : read;
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
        const auto found = transfer_of(options, loaded, mode);
        if (!found)
            return fail("{}", found.error().message);
        layer.transfer = *found;
    }
    if (!options.isos.empty()) {
        if (options.isos.size() > kMaxIsos)
            return fail("--iso: expected at most {} values, found {}", kMaxIsos,
                        options.isos.size());
        layer.isos = iso_surfaces(options.isos);
    }
    if (options.step_mm >= 0)
        layer.step_mm = options.step_mm;
    if (options.sub_steps > 0)
        layer.sub_steps = options.sub_steps;
    if (options.jitter_seed)
        layer.jitter_seed = options.jitter_seed;
    if (options.min_transmittance >= 0)
        layer.min_transmittance = options.min_transmittance;
    if (options.shade)
        layer.shading = Shading{};
    if (options.no_shade)
        layer.shading.reset();
    return {};
}

Result<void> apply_camera(const SceneOptions& options, const Grid& grid, Scene& scene) {
    const bool sets_distance = (options.fill || options.view_angle_deg) &&
                               scene.camera.projection == Projection::perspective;
    if (!options.camera.empty()) {
        const auto& v = options.camera;
        if (v.size() != 6 && v.size() != 9)
            return fail("--camera: expected 6 or 9 numbers, found {}", v.size());
        scene.camera.eye_mm = {v[0], v[1], v[2]};
        scene.camera.target_mm = {v[3], v[4], v[5]};
        if (v.size() == 9)
            scene.camera.up = {v[6], v[7], v[8]};
        scene.camera.view_angle_deg = options.view_angle_deg.value_or(30.0);
        const glm::dvec3 forward = scene.camera.target_mm - scene.camera.eye_mm;
        if (!(glm::length(glm::cross(forward, scene.camera.up)) > 1e-9 * glm::length(forward)))
            return fail(
                "--camera: expected a target apart from the eye and an up that is not the "
                "view direction");
    } else if (!options.view.empty() || (sets_distance && !is_scene_file(options.input))) {
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

void apply_stereo(const SceneOptions& options, Scene& scene) {
    if (options.stereo && !scene.stereo) {
        // A comfortable pair: the eyes converge on the target, 1/30 of the distance apart.
        const double distance = glm::length(scene.camera.target_mm - scene.camera.eye_mm);
        scene.stereo = StereoSettings{{distance / 30.0, distance}, *options.stereo};
    }
    if (options.stereo)
        scene.stereo->layout = *options.stereo;
    if (scene.stereo && options.eye_separation_mm > 0)
        scene.stereo->rig.eye_separation_mm = options.eye_separation_mm;
    if (scene.stereo && options.convergence_mm > 0)
        scene.stereo->rig.convergence_mm = options.convergence_mm;
}

} // namespace

bool is_scene_file(const std::string& input) {
    return input.ends_with(".json") && !is_synthetic(input);
}

bool fill_counts(const SceneOptions& options, const SceneFile& file, const Scene& scene) {
    if (!options.camera.empty() || !options.view.empty())
        return options.camera.empty();
    return is_scene_file(options.input) ? file.framing.has_value()
                                        : scene.ray_cast || scene.slices.size() != 1;
}

void add_scene_options(CLI::App& app, SceneOptions& o) {
    app.add_option("SCENE", o.input,
                   "Scene file (.json), or a volume: file, DICOM folder, slice pattern, "
                   "synthetic:NAME")
        ->required();
    app.add_option("--labels", o.labels, "Label map shown with the volume (default: none)")
        ->type_name("FILE");
    app.add_option("--mode", o.mode,
                   "How rays see the volume (default: alpha; none with --slice alone; a label "
                   "map's surfaces; a volume one sample thick as its slice)")
        ->transform(named<RayMode>());
    app.add_option("--iso", o.isos,
                   "Iso-values, in the volume's units (default: 300 HU for CT, else by the values)")
        ->delimiter(',');
    CLI::Option* transfer =
        app.add_option("--tf", o.transfer,
                       fmt::format("Transfer function: a preset ({}) or a JSON file (default: by "
                                   "modality and values; see docs/scene.md)",
                                   fmt::join(preset_names(), ", ")));
    CLI::Option* window =
        app.add_option("--window", o.window,
                       "Grey from LOW to HIGH, in the volume's units, instead of --tf")
            ->delimiter(',')
            ->expected(2)
            ->excludes(transfer);
    app.add_option("--window-level", o.window_level,
                   "The same as radiologists say it: LEVEL,WIDTH is LEVEL - WIDTH/2 to LEVEL + "
                   "WIDTH/2")
        ->delimiter(',')
        ->expected(2)
        ->excludes(transfer)
        ->excludes(window);
    app.add_option("--integrator", o.integrator, "Of the rays (default: fast)")
        ->transform(named<Integrator>());
    app.add_option("--sub-steps", o.sub_steps,
                   "Exact, alpha: pieces of a cell's part of a ray at most (default: 8)")
        ->check(CLI::Range(1u, kMaxSubSteps));
    app.add_option("--jitter", o.jitter_seed,
                   "Fast, preintegrated: move each ray's samples by a share of a step that a hash "
                   "of its pixel and this seed gives (default: none)");
    app.add_option(
           "--step", o.step_mm,
           "Distance between samples in mm; 0 is the smallest spacing (default: half of that for "
           "alpha, else 0)")
        ->check(non_negative());
    CLI::Option* shade =
        app.add_flag("--shade", o.shade, "Shade by the gradient (default: on for alpha and iso)");
    app.add_flag("--no-shade", o.no_shade, "Alpha: no gradient shading")->excludes(shade);
    app.add_option("--min-transmittance", o.min_transmittance,
                   "A ray stops when less light comes through, 0 .. 1 (default: 1/1024)")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--slice", o.slices,
                   "A slice: axial, coronal or sagittal, with :MM for its place in mm (LPS), or "
                   "px,py,pz,nx,ny,nz (default place: the centre); repeatable");
    app.add_option("--interpolation", o.interpolation, "Slices (default: linear)")
        ->transform(named<Interpolation>());
    app.add_option("--slab", o.slab_mm, "Slices: thickness in mm (default: 0)")
        ->check(non_negative());
    app.add_option("--slab-mode", o.slab_mode, "Slabs (default: mean)")
        ->transform(named<SlabMode>());
    app.add_option("--surface", o.surfaces,
                   "A mesh in the picture: a PLY, STL, OBJ or VTP file, iso=VALUE for the volume's "
                   "surface at "
                   "that value, or labels for those of the label map; repeatable (default: none)")
        ->type_name("SOURCE");
    app.add_option("--surface-color", o.surface_colors,
                   "Surfaces, in their order: r,g,b, 0 .. 1; repeatable (default: bone, skin, ..)");
    app.add_option("--surface-opacity", o.surface_opacities,
                   "Surfaces, in their order: 0 .. 1, apart by commas (default: 1)")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--surface-depth", o.surface_depth,
                   "How many see-through triangles are blended at a pixel; those behind them are "
                   "left out (default: 8)")
        ->check(CLI::Range(1u, kMaxSurfaceDepth));
    app.add_option("--clip", o.clips,
                   "Keep the side of a plane its normal points to: px,py,pz,nx,ny,nz in mm "
                   "(LPS); "
                   "repeatable");
    app.add_option("--view", o.view,
                   fmt::format("Camera: {} (default: oblique)", fmt::join(view_names(), ", ")))
        ->check(one_of(view_names()));
    app.add_option("--fill", o.fill, "--view: below 1 comes closer (default: 0.8)")
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
    app.add_option("--stereo", o.stereo, "How both eyes lie in the picture (default: one eye)")
        ->transform(named<StereoLayout>());
    app.add_option("--eye-separation", o.eye_separation_mm,
                   "Stereo: mm between the eyes (default: 1/30 of the distance)")
        ->check(positive());
    app.add_option("--convergence", o.convergence_mm,
                   "Stereo: mm to where both eyes meet (default: the target)")
        ->check(positive());
    app.add_option("--background", o.background, "Colour r,g,b, 0 .. 1 (default: black)")
        ->delimiter(',')
        ->expected(3)
        ->check(CLI::Range(0.0, 1.0));
    app.add_flag("--values", o.values,
                 "EXR: also write value and depth in mm (default: colours only)");
}

namespace {

bool asks_for_nothing(const SceneOptions& o) {
    return o.slices.empty() && !o.mode && o.isos.empty() && o.surfaces.empty();
}

} // namespace

void show_labels_by_default(const SceneOptions& options, SceneFile& file, LoadedScene& loaded) {
    const Scene& scene = file.scene;
    if (scene.ray_cast || !scene.slices.empty() || !scene.surfaces.empty() ||
        !file.labels.empty() || !asks_for_nothing(options) || has_transfer(options) ||
        !is_label_map(loaded))
        return;
    log::info(
        "{}: a label map, by its values, so the surfaces of its labels are drawn (--mode "
        "alpha draws its numbers)",
        file.volume);
    file.labels = file.volume;
    file.surfaces = {SurfaceSource{.mesh = {}, .iso = {}, .labels = true}};
    file.scene.surfaces = {SurfaceLayer{}};
    file.scene.labels = LabelLayer{};
    loaded.data.labels = loaded.data.volume;
}

Result<SceneFile> base_scene(const SceneOptions& options) {
    SceneFile file;
    if (is_scene_file(options.input)) {
        Result<SceneFile> loaded = load_scene(options.input);
        if (!loaded)
            return loaded;
        file = std::move(*loaded);
    } else {
        file.volume = options.input;
        file.framing = Framing{};
    }
    if (!options.labels.empty()) {
        file.labels = is_synthetic(options.labels)
                          ? options.labels
                          : std::filesystem::absolute(options.labels).string();
        if (!file.scene.labels)
            file.scene.labels = LabelLayer{};
    }
    if (auto applied = apply_surfaces(options, file); !applied)
        return pass_on(applied);
    return file;
}

std::optional<StereoLayout> stereo_layout(const SceneOptions& options, const Scene& scene) {
    return options.stereo ? options.stereo
           : scene.stereo ? std::optional(scene.stereo->layout)
                          : std::nullopt;
}

void append_files(const SceneFile& scene, std::vector<NamedFile>& files) {
    for (const auto& [what, name] :
         {std::pair("the volume of SCENE", &scene.volume), {"the labels of SCENE", &scene.labels}})
        if (!name->empty() && !is_synthetic(*name))
            append_volume(files, what, volume_path(scene, *name).string());
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
    if (options.size_px.size() == 2)
        scene.size_px = {options.size_px[0], options.size_px[1]};
    if (options.background.size() == 3)
        scene.background = {options.background[0], options.background[1], options.background[2]};
    scene.value_and_depth = scene.value_and_depth || options.values;
    const bool nothing_asked = from_volume && asks_for_nothing(options);
    const std::optional<SliceLayer> plane = nothing_asked ? only_slice(grid) : std::nullopt;
    if (plane) {
        log::info("{}: one sample thick, so it is drawn as a slice (--mode alpha draws a volume)",
                  file.volume);
        scene.slices = {*plane};
    } else if (nothing_asked) {
        scene.ray_cast = default_ray_cast(RayMode::alpha, loaded);
    }
    const ValueRange range = loaded.data.volume.range();
    if (nothing_asked && !(range.min < range.max))
        log::warning(
            "{}: {}, so there is nothing to see", file.volume,
            range.empty() ? "no sample has data" : fmt::format("all samples are {:g}", range.min));
    if (from_volume && is_ct_without_offset(loaded))
        log::info("{}: a CT without values below -200, taken as HU + 1024", file.volume);
    if (auto done = apply_ray_cast(options, loaded, scene); !done)
        return pass_on(done);
    if (auto done = apply_slices(options, grid, scene); !done)
        return pass_on(done);
    if (!scene.slices.empty() && scene.slice_transfer.colors.empty())
        scene.slice_transfer = default_slice_transfer(loaded);
    if (!scene.slices.empty() && has_transfer(options)) {
        const auto found = transfer_of(options, loaded, RayMode::mip);
        if (!found)
            return fail("{}", found.error().message);
        scene.slice_transfer = *found;
    }
    if (!is_scene_file(options.input))
        scene.camera = default_camera(scene, loaded.data);
    if (auto done = apply_clips(options, scene); !done)
        return pass_on(done);
    if (auto done = apply_camera(options, grid, scene); !done)
        return pass_on(done);
    apply_stereo(options, scene);
    return scene;
}

} // namespace palpate
