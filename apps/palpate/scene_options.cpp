#include "apps/palpate/scene_options.h"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "apps/palpate/default_scene.h"
#include "apps/palpate/option_checks.h"
#include "engine/base/log.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

// The value of an enum by the name scene files give it.
template <class Enum>
Result<Enum> enum_of(const char* option, const std::string& text) {
    std::string known;
    for (const auto& [name, value] : Names<Enum>::list) {
        if (text == name)
            return value;
        known += known.empty() ? name : fmt::format(", {}", name);
    }
    return fail("{}: expected one of {}, found '{}'", option, known, text);
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
        if (!options.interpolation.empty()) {
            const auto found = enum_of<Interpolation>("--interpolation", options.interpolation);
            if (!found)
                return fail("{}", found.error().message);
            slice.interpolation = *found;
        }
        if (!options.slab_mode.empty()) {
            const auto found = enum_of<SlabMode>("--slab-mode", options.slab_mode);
            if (!found)
                return fail("{}", found.error().message);
            slice.slab_mode = *found;
        }
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

Result<TransferFunction> transfer_of(const SceneOptions& options, const LoadedScene& loaded,
                                     RayMode mode) {
    const Grid& grid = loaded.data.volume.grid();
    if (!options.window.empty()) {
        if (!(options.window[0] < options.window[1]))
            return fail("--window: expected LOW below HIGH, found {},{}", options.window[0],
                        options.window[1]);
        return window_function(options.window[0], options.window[1],
                               mode == RayMode::mip ? 1.0 : 0.1, preset_unit_mm(grid));
    }
    if (const auto found = preset(options.transfer))
        return fitted(*found, options.transfer, loaded);
    Result<TransferFunction> read = load_transfer_function(options.transfer);
    return read ? sized(*read, grid) : read;
}

Result<void> apply_ray_cast(const SceneOptions& options, const LoadedScene& loaded, Scene& scene) {
    const bool wanted = !options.mode.empty() || !options.isos.empty();
    if (!wanted && !scene.ray_cast)
        return {};
    RayMode mode = scene.ray_cast ? scene.ray_cast->mode : RayMode::iso;
    if (!options.mode.empty()) {
        const auto found = enum_of<RayMode>("--mode", options.mode);
        if (!found)
            return fail("{}", found.error().message);
        mode = *found;
    }
    if (!scene.ray_cast || scene.ray_cast->mode != mode)
        scene.ray_cast = default_ray_cast(mode, loaded);
    RayCastLayer& layer = *scene.ray_cast;
    if (!options.integrator.empty()) {
        const auto found = enum_of<Integrator>("--integrator", options.integrator);
        if (!found)
            return fail("{}", found.error().message);
        layer.integrator = *found;
    }
    if (!options.window.empty() || !options.transfer.empty()) {
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
    if (!options.camera.empty()) {
        const auto& v = options.camera;
        if (v.size() != 6 && v.size() != 9)
            return fail("--camera: expected 6 or 9 numbers, found {}", v.size());
        scene.camera.eye_mm = {v[0], v[1], v[2]};
        scene.camera.target_mm = {v[3], v[4], v[5]};
        if (v.size() == 9)
            scene.camera.up = {v[6], v[7], v[8]};
        scene.camera.view_angle_deg = options.view_angle_deg;
        const glm::dvec3 forward = scene.camera.target_mm - scene.camera.eye_mm;
        if (!(glm::length(glm::cross(forward, scene.camera.up)) > 1e-9 * glm::length(forward)))
            return fail(
                "--camera: expected a target apart from the eye and an up that is not the "
                "view direction");
    } else if (!options.view.empty()) {
        const std::optional<ViewDirection> view = view_direction(options.view);
        if (!view)
            return fail("--view: expected one of {}, found '{}'", view_names(), options.view);
        scene.camera =
            frame_volume(grid, view->towards, view->up, options.fill, options.view_angle_deg);
    }
    if (!options.projection.empty()) {
        const auto found = enum_of<Projection>("--projection", options.projection);
        if (!found)
            return fail("{}", found.error().message);
        scene.camera.projection = *found;
    }
    return {};
}

Result<void> apply_stereo(const SceneOptions& options, Scene& scene) {
    if (!options.stereo.empty()) {
        const auto layout = enum_of<StereoLayout>("--stereo", options.stereo);
        if (!layout)
            return fail("{}", layout.error().message);
        if (!scene.stereo) {
            // A comfortable pair: the eyes converge on the target, 1/30 of the distance apart.
            const double distance = glm::length(scene.camera.target_mm - scene.camera.eye_mm);
            scene.stereo = StereoSettings{{distance / 30.0, distance}, *layout};
        }
        scene.stereo->layout = *layout;
    }
    if (scene.stereo && options.eye_separation_mm > 0)
        scene.stereo->rig.eye_separation_mm = options.eye_separation_mm;
    if (scene.stereo && options.convergence_mm > 0)
        scene.stereo->rig.convergence_mm = options.convergence_mm;
    return {};
}

} // namespace

void add_scene_options(CLI::App& app, SceneOptions& o) {
    app.add_option("SCENE", o.input,
                   "Scene file (.json), or a volume: file, DICOM folder, slice pattern, "
                   "synthetic:NAME")
        ->required();
    app.add_option("--labels", o.labels, "Label map shown with the volume (default: none)")
        ->type_name("FILE");
    app.add_option(
        "--mode", o.mode,
        "mip, alpha or iso (default: alpha; none with --slice alone; a label map's surfaces; a "
        "volume one sample thick as its slice)");
    app.add_option("--iso", o.isos,
                   "Iso-values, in the volume's units (default: 300 HU for CT, else by the values)")
        ->delimiter(',');
    app.add_option(
        "--tf", o.transfer,
        "Transfer function: a preset or a JSON file (default: by modality and values; see "
        "docs/scene.md)");
    app.add_option("--window", o.window,
                   "Grey from LOW to HIGH, in the volume's units, instead of --tf")
        ->delimiter(',')
        ->expected(2);
    app.add_option("--integrator", o.integrator, "fast, preintegrated or exact (default: fast)");
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
    app.add_flag("--shade", o.shade, "Shade by the gradient (default: on for alpha and iso)");
    app.add_flag("--no-shade", o.no_shade, "No gradient shading");
    app.add_option("--min-transmittance", o.min_transmittance,
                   "A ray stops when less light comes through, 0 .. 1 (default: 1/1024)")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--slice", o.slices,
                   "A slice: axial, coronal or sagittal, with :MM for its place in world mm, or "
                   "px,py,pz,nx,ny,nz (default place: the centre); repeatable");
    app.add_option("--interpolation", o.interpolation, "Slices: linear or cubic (default: linear)");
    app.add_option("--slab", o.slab_mm, "Slices: thickness in mm (default: 0)")
        ->check(non_negative());
    app.add_option("--slab-mode", o.slab_mode, "Slabs: mean or maximum (default: mean)");
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
                   "Keep the side of a plane its normal points to: px,py,pz,nx,ny,nz in mm; "
                   "repeatable");
    app.add_option("--view", o.view, fmt::format("Camera: {} (default: oblique)", view_names()));
    app.add_option("--fill", o.fill, "--view: below 1 comes closer (default: 0.8)")
        ->check(positive());
    app.add_option("--view-angle", o.view_angle_deg, "Angle from bottom to top in degrees")
        ->capture_default_str()
        ->check(CLI::Range(0.001, 179.0));
    app.add_option("--camera", o.camera,
                   "Camera: eye and target in mm, and up: ex,ey,ez,tx,ty,tz[,ux,uy,uz]")
        ->delimiter(',');
    app.add_option("--projection", o.projection,
                   "perspective or orthographic (default: perspective)");
    app.add_option("--size", o.size_px, "Width and height in pixels (default: 512,512)")
        ->delimiter(',')
        ->expected(2)
        ->check(CLI::Range(1, 16384));
    app.add_option("--stereo", o.stereo,
                   "side_by_side, top_bottom, row_interleaved, anaglyph or separate "
                   "(default: one eye)");
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
    return o.slices.empty() && o.mode.empty() && o.isos.empty() && o.surfaces.empty();
}

} // namespace

void show_labels_by_default(const SceneOptions& options, SceneFile& file, LoadedScene& loaded) {
    const Scene& scene = file.scene;
    if (scene.ray_cast || !scene.slices.empty() || !scene.surfaces.empty() ||
        !file.labels.empty() || !asks_for_nothing(options) || !options.transfer.empty() ||
        !options.window.empty() || !is_label_map(loaded))
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
    if (options.input.ends_with(".json") && !is_synthetic(options.input)) {
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
    if (!options.stereo.empty()) {
        const auto asked = enum_of<StereoLayout>("--stereo", options.stereo);
        return asked ? std::optional(*asked) : std::nullopt;
    }
    return scene.stereo ? std::optional(scene.stereo->layout) : std::nullopt;
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
    if ((plane || !options.slices.empty()) &&
        (!options.window.empty() || !options.transfer.empty())) {
        const auto found = transfer_of(options, loaded, RayMode::mip);
        if (!found)
            return fail("{}", found.error().message);
        scene.slice_transfer = *found;
    }
    const bool shows_labels =
        loaded.data.labels && loaded.data.labels->is_same_as(loaded.data.volume);
    if (from_volume || shows_labels)
        scene.camera = default_camera(scene, loaded.data);
    if (auto done = apply_clips(options, scene); !done)
        return pass_on(done);
    if (auto done = apply_camera(options, grid, scene); !done)
        return pass_on(done);
    if (auto done = apply_stereo(options, scene); !done)
        return pass_on(done);
    return scene;
}

} // namespace palpate
