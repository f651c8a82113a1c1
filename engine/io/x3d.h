#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/io/mesh_io.h"
#include "engine/scene/scene_file.h"

namespace palpate {

// A scene of X3D (ISO/IEC 19775-1, in XML), as haptic toolkits keep them; the part that a scene of
// this program can hold. Metres become millimetres; axes stay as they are.
//
//   Transform, Group, DEF and USE      places
//   IndexedFaceSet, IndexedTriangleSet, Box, Sphere, Cylinder, Cone
//                                      one mesh; convex faces are cut into fans
//   Material                           diffuseColor and transparency; one label of the mesh each
//   Viewpoint                          the camera (the first one)
//   Background                         its first colour
//   ClipPlane                          at most 8 planes
//   StereoInfo                         interocularDistance, focalDistance
//   VolumeData, IsoSurfaceVolumeData, SegmentedVolumeData
//                                      the file of the volume (the url of a texture), iso-values,
//                                      labels; MIP by a ProjectionVolumeStyle, else opacity. The
//                                      volume lies where its file says.
//
// All else is left out: `skipped` has the names of the nodes, each once, in the order of the file.
struct X3dScene {
    Mesh mesh;                           // of all shapes, world mm; labels number the styles from 1
    std::vector<SurfaceStyle> materials; // [0] of label 1
    std::optional<Camera> camera;
    std::optional<glm::dvec3> background;
    std::vector<ClipPlane> clip_planes;
    std::optional<StereoRig> stereo;
    std::string volume, labels; // files as they are named; empty: none
    RayMode mode = RayMode::alpha;
    std::vector<double> isos; // in the volume's units
    std::vector<std::string> skipped;
};

// An error is one sentence that names the file, what was expected and what was found.
Result<X3dScene> load_x3d(const std::filesystem::path& path, const MeshReadOptions& options = {});

// The same as a scene of this program, whose surface is the file itself. Its rays have no transfer
// function: that of the volume is chosen when it is loaded. Refused where it names no volume.
Result<SceneFile> load_x3d_scene(const std::filesystem::path& path);

// Whether a path ends in .x3d.
bool is_x3d_file(const std::filesystem::path& path);

} // namespace palpate
