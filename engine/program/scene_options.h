#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/given_settings.h"
#include "engine/io/scene_data.h"
#include "engine/program/named_files.h"
#include "engine/scene/scene_file.h"

namespace CLI {
class App;
}

namespace palpate {

// The options of `palpate render` that say what is drawn. Where the input is a scene file, they
// replace what the file says; where it is a volume, they start from a scene that suits it.
struct SceneOptions {
    std::string input;  // SCENE.json, a project, a volume, or synthetic:NAME
    std::string volume; // in place of the scene's own
    std::string labels, fused, overlay;
    std::string label_names;              // a table of labels
    std::vector<std::string> only_labels; // by number or name; empty: all
    std::optional<RayMode> mode;
    std::optional<Integrator> integrator;
    std::optional<StereoLayout> stereo;
    std::optional<Interpolation> interpolation;
    std::optional<SlabMode> slab_mode;
    std::optional<Projection> projection;
    std::string transfer, window_preset, fused_transfer, view, background;
    std::vector<double> window, window_level, isos, camera, light;
    std::vector<std::string> slices, clips, surfaces, surface_colors;
    std::vector<double> surface_opacities;
    std::vector<uint32_t> size_px;
    GivenSettings<RayCastLayer> ray_cast_settings;
    GivenSettings<SliceLayer> slice_settings;
    GivenSettings<FusionLayer> fusion_settings;
    GivenSettings<Scene> scene_settings;
    std::optional<double> fill, view_angle_deg;
    double eye_separation_mm = -1, convergence_mm = -1;
    std::optional<uint32_t> jitter_seed;
    bool shade = false, no_shade = false, values = false, swap_eyes = false, mirror = false;

    // The picture has alpha; the scene's background is black then.
    bool transparent() const { return background == "transparent"; }
};

void add_scene_options(CLI::App& app, SceneOptions& options);

// Whether an input names a scene file, by its ending .json, and not a volume or a project.
bool is_scene_file(const std::string& input);

// Whether an input says how it is seen: a scene file or a project.
bool has_scene(const std::string& input);

// Whether --fill moves the camera: where the volume decides its place. `file` is what base_scene()
// gave, `scene` what final_scene() made of it.
bool fill_counts(const SceneOptions& options, const SceneFile& file, const Scene& scene);

// The scene file the options start from, its volumes and meshes not yet loaded.
Result<SceneFile> base_scene(const SceneOptions& options);

// How both eyes of a scene will lie in its picture; none where it has one eye.
std::optional<StereoLayout> stereo_layout(const SceneOptions& options, const Scene& scene);

// The volumes that a scene names, for each_its_own().
void append_files(const SceneFile& scene, std::vector<NamedFile>& files);

// Draws the surfaces of a volume that is a label map by its values if nothing says what to draw,
// with a note. For between loading the volumes and making meshes.
void show_labels_by_default(const SceneOptions& options, SceneFile& file, LoadedScene& loaded);

// --only-label: hides the other labels of the map in rays, slices and surfaces. An error where no
// sample has a label of that number or name.
Result<void> hide_other_labels(const SceneOptions& options, SceneFile& file,
                               const LoadedScene& loaded);

// Applies the options to a scene whose volumes are loaded, and settles what depends on them:
// camera, slice positions, default transfer functions.
Result<Scene> final_scene(const SceneOptions& options, SceneFile file, const LoadedScene& loaded);

} // namespace palpate
