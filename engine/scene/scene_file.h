#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/scene.h"

namespace palpate {

// A camera that follows the volume: frame_volume() from this direction. Kept apart from the scene
// until the volume is known.
struct Framing {
    glm::dvec3 direction{0.0, -1.0, 0.0}; // from the volume towards the eye, world; not 0
    glm::dvec3 up{0.0, 0.0, 1.0};
    double fill = 0.8; // see frame_volume(); > 0
    double view_angle_deg = 30.0;
    Projection projection = Projection::perspective;

    friend bool operator==(const Framing&, const Framing&) = default;
};

// The source of the mesh of a surface layer: one of the three is set.
struct SurfaceSource {
    std::string mesh;          // a file, relative to the scene's folder
    std::optional<double> iso; // the volume's surface at this value
    bool labels = false;       // the surfaces of the scene's labels

    friend bool operator==(const SurfaceSource&, const SurfaceSource&) = default;
};

// A scene and the sources of its voxels: one JSON file. Keys: docs/reference/scene.md.
struct SceneFile {
    Scene scene;
    std::string volume; // a file or folder relative to `folder`, or "synthetic:NAME?key=value"
    std::string labels; // the same; empty for none
    std::string fused, overlay;          // the same; a volume over slices, and more labels
    std::vector<SurfaceSource> surfaces; // one a surface of the scene
    uint32_t frame = 0;                  // which volume of a 4-D file
    std::string series;                  // DICOM: the series' UID; empty for the largest
    bool resample_slices = false;        // DICOM: slices at uneven distances are interpolated
    bool transparent = false;            // pictures keep alpha; the background is black then

    // Settings that depend on the volume: see resolved_scene().
    std::optional<Framing> framing;
    std::vector<size_t> centered_slices; // slices whose point is the volume's centre
    std::vector<size_t> centered_clips;  // and clip planes; both ascending

    std::filesystem::path folder; // of the file; no part of what is written or hashed
};

// The scene with camera, slices, clip planes and the opacity of presets set from the volume's
// grid.
Scene resolved_scene(const SceneFile& file, const Grid& grid);

// True for "synthetic:...".
bool is_synthetic(std::string_view volume);

// The path of a volume that a scene names: joined to the scene's folder where it is relative.
std::filesystem::path volume_path(const SceneFile& file, std::string_view volume);

// `name` is the file's, for messages; `folder` is where transfer-function files are looked up.
// An error names the file, the line, the key (ray_cast.isos[1].value), and what was expected and
// found. Unknown keys are errors.
Result<SceneFile> parse_scene(std::string_view text, const std::string& name,
                              const std::filesystem::path& folder = {});
Result<SceneFile> load_scene(const std::filesystem::path& path);

// Text that parse_scene() reads back as the same scene. All values are written, transfer functions
// as points, so that it is self-contained.
std::string write_scene(const SceneFile& file);

// 16 hexadecimal digits of the written text (FNV-1a, 64 bits): the same on every machine.
std::string scene_hash(const SceneFile& file);

} // namespace palpate
