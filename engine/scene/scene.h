#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"
#include "engine/scene/camera.h"
#include "engine/scene/transfer_function.h"
#include "engine/volume/volume.h"

namespace palpate {

enum class RayMode { mip, alpha, iso };
enum class Integrator { fast, preintegrated, exact };
enum class StereoLayout { // engine/render/display_layout.h
    side_by_side,
    top_bottom,
    row_interleaved,
    column_interleaved,
    checkerboard,
    anaglyph,
    left,
    right,
    separate
};
enum class SlabMode { mean, maximum, minimum };
enum class Interpolation { linear, cubic };

struct IsoSurface {
    double value; // in the volume's units
    glm::dvec3 color{1.0, 0.94, 0.85};
    double opacity = 1.0; // 0 < opacity <= 1

    friend bool operator==(const IsoSurface&, const IsoSurface&) = default;
};

// Blinn-Phong with a light at the eye, or from a RayCastLayer's own direction; the weights of
// ambient, diffuse and specular light. Their sum is 1 by default, so that white that faces the eye
// is white, and nothing is clipped.
struct Shading {
    double ambient = 0.2, diffuse = 0.65, specular = 0.15;
    double shininess = 10.0;

    friend bool operator==(const Shading&, const Shading&) = default;
};

// A light far away, by its direction in the camera's frame; both 0 is along the view direction.
struct Light {
    double azimuth_deg = 0.0;   // to the viewer's right, -180 .. 180
    double elevation_deg = 0.0; // up, -90 .. 90

    friend bool operator==(const Light&, const Light&) = default;
};

// Ray casting. Samples lie on one lattice: segment k of a ray covers the distances [k, k + 1) *
// step_mm from its start, cut by the volume's box, the clip planes and the slices; a segment is
// sampled at its middle. So skipping space and splitting work change no picture.
//
// Integrator `exact` cuts each ray at the faces of the cells between samples instead, where the
// trilinear field along it is one cubic, and uses no step: alpha integrates the transfer function
// over at most `sub_steps` pieces of a cell, iso finds every root, MIP the maximum of the cubic.
struct RayCastLayer {
    RayMode mode = RayMode::alpha;
    Integrator integrator = Integrator::fast;
    double step_mm = 0.0; // > 0; 0 means the smallest spacing of the volume
    uint32_t sub_steps =
        8; // exact alpha: 1 .. kMaxSubSteps; fewer are taken where a cell is straight
    TransferFunction transfer;
    std::vector<IsoSurface> isos;   // mode iso: 1 .. 8, sorted by value
    std::optional<Shading> shading; // alpha: unshaded if absent; iso always shades, with defaults
    // The light of shaded alpha and iso, caps included; absent: at the eye. Sides turned away from
    // it have ambient light alone. Nothing casts shadows.
    std::optional<Light> light{};
    // Iso: ambient occlusion, a cue to depth and not a simulation of light: what is lit is
    // multiplied by how open the surface is. That is the mean, over 24 fixed directions and their
    // opposites on the side of the ray, weighted with the cosine to the normal, of the share of 8
    // places up to so many mm away that no place before them, nor they themselves, bring to the
    // surface's value. 0 is none. The share falls from 1 to 0 over a sixteenth of the radius, by
    // the slope at the surface, and the places begin that far before it. What clip planes cut away
    // is free.
    double occlusion_mm = 0.0;
    // Moves each ray's lattice by a share of a step, which a hash of its pixel and this seed gives:
    // the rings of a coarse step become noise. Not used by `exact`.
    std::optional<uint32_t> jitter_seed;
    double min_transmittance = 1.0 / 1024.0; // a ray stops below it; bounds the error in colour

    friend bool operator==(const RayCastLayer&, const RayCastLayer&) = default;
};

// A plane through the volume, opaque wherever it lies inside the sampled box.
struct SliceLayer {
    glm::dvec3 point_mm{0.0};
    glm::dvec3 normal{0.0, 0.0, 1.0}; // any length but 0
    Interpolation interpolation = Interpolation::linear;
    double slab_mm = 0.0; // thickness about the plane; 0 is a plain slice
    SlabMode slab_mode = SlabMode::mean;

    friend bool operator==(const SliceLayer&, const SliceLayer&) = default;
};

// Keeps the half space where dot(normal, x - point_mm) >= 0.
struct ClipPlane {
    glm::dvec3 point_mm{0.0};
    glm::dvec3 normal{1.0, 0.0, 0.0};

    friend bool operator==(const ClipPlane&, const ClipPlane&) = default;
};
constexpr uint32_t kMaxSubSteps = 64;
// `exact`, alpha: largest colour error of a pixel for one sub-step. A sub-step with a larger error,
// as in dense matter that changes its colour, is divided further.
constexpr double span_tolerance(uint32_t sub_steps) {
    return 0.01 / (static_cast<double>(sub_steps) * sub_steps);
}
constexpr size_t kMaxClipPlanes = 8;
constexpr size_t kMaxIsos = 8;
constexpr size_t kMaxSlices = 8;

struct LabelStyle { // how one label is shown
    glm::dvec3 color{1.0};
    bool visible = true;
    double opacity = 1.0; // 0 .. 1: of its surface in 3D

    friend bool operator==(const LabelStyle&, const LabelStyle&) = default;
};

// The edge between two labels on slices: halfway between two samples, where their
// weights in linear interpolation are equal, or at the sides of the samples' boxes.
enum class LabelEdges { smooth, voxels };

// How a label map is shown. Labels are those of samples, never blended; on slices with smooth edges
// that of the largest weight, and everywhere else that of the nearest sample. Label 0 is
// background: never coloured and always visible.
struct LabelLayer {
    std::vector<LabelStyle> styles;        // by label number; labels beyond take generated colours
    double ray_cast_weight = 0.7;          // 0 .. 1: how far labels tint rays; 0: none matters
    double slice_opacity = 0.4;            // 0 .. 1: of the filled overlay on slices
    double outline_px = 1.0;               // width of the outline on slices; 0 draws none
    LabelEdges edges = LabelEdges::smooth; // on slices

    friend bool operator==(const LabelLayer&, const LabelLayer&) = default;
};

// Another volume in colour over slices, with a grid of its own: a pixel takes its colour by
// `opacity` times the transfer function's opacity, linear between samples; nothing outside of its
// samples and where it has no data. Under the labels.
struct FusionLayer {
    TransferFunction transfer;
    double opacity = 0.5; // 0 .. 1

    friend bool operator==(const FusionLayer&, const FusionLayer&) = default;
};

// How triangles are shown: those of one label, or all of a mesh without labels.
struct SurfaceStyle {
    glm::dvec3 color{1.0, 0.94, 0.85};
    double opacity = 1.0; // 0 .. 1; 0 is not shown at all, not even by a cap

    friend bool operator==(const SurfaceStyle&, const SurfaceStyle&) = default;
};

// A mesh in the picture. Triangles are seen and lit from both sides: a wall between two labels in
// the style of the one behind it, or, where that is not shown (as label 0, the background, never
// is), of the one before it. An opaque one hides what lies behind it and ends the rays; others are
// blended in their order along the ray with ray casting, the nearest Scene::surface_depth of them
// at each pixel. Where a clip plane cuts into what a mesh encloses, the cut is closed by a cap, lit
// by the plane's normal; where several do, the cap is that of the layer listed last. What a mesh
// encloses is counted by crossings: caps are right for closed meshes only.
struct SurfaceLayer {
    SurfaceStyle style; // of triangles without label; its opacity is that of labels without style
    std::vector<SurfaceStyle> label_styles; // by label; labels beyond take generated colours
    Shading shading;
    bool smooth = true; // by the mesh's normals, where it has any; else each triangle by its own
    // Live: in place of a mesh, the surface of SceneData::volume at this value, closed at the
    // border. It is extracted into the memory it is drawn from, and follows the volume: of a later
    // snapshot only the blocks of 8^3 samples are made again that read a changed sample. The
    // picture is that of the mesh, to the bit; with flat shading but where a ray runs exactly
    // through a vertex at which the surface folds twice.
    std::optional<double> live_iso{};
    // Live, too: in place of a mesh, the walls between all labels of SceneData::labels, smoothed
    // (engine/surface/block_nets.h), which follow the labels' edits. Colour, opacity and what is
    // shown of each label are those of Scene::labels, its opacity times the one of `style`; so
    // another style makes no triangle anew. Nothing is drawn in a scene without labels.
    bool live_labels = false;

    friend bool operator==(const SurfaceLayer&, const SurfaceLayer&) = default;
};
constexpr size_t kMaxSurfaces = 8;
constexpr uint32_t kMaxSurfaceDepth = 16;

struct StereoSettings {
    StereoRig rig;
    StereoLayout layout = StereoLayout::side_by_side;
    bool swap_eyes = false; // each eye is shown in place of the other

    friend bool operator==(const StereoSettings&, const StereoSettings&) = default;
};

// All settings of a picture, without the voxels. A value: it can be compared, hashed, read from and
// written to JSON (engine/scene/scene_file.h).
struct Scene {
    glm::uvec2 size_px{512, 512}; // of one eye's picture
    Camera camera;
    std::optional<StereoSettings> stereo;
    bool mirror = false; // shown upside down, for a screen that is seen in a mirror
    glm::dvec3 background{0.0};
    std::optional<RayCastLayer> ray_cast;
    std::vector<SliceLayer> slices;     // at most kMaxSlices; grey by slice_transfer
    TransferFunction slice_transfer;    // used when there are slices; opacity is ignored
    std::vector<ClipPlane> clip_planes; // at most kMaxClipPlanes; they cut all but slices
    std::optional<LabelLayer> labels;   // needs SceneData::labels
    std::optional<FusionLayer> fusion;  // needs SceneData::fused; on slices alone
    std::optional<LabelLayer> overlay;  // the same of SceneData::overlay, over all of this
    std::vector<SurfaceLayer> surfaces; // at most kMaxSurfaces; SceneData::meshes has one for each
    // Maximum number of translucent triangles blended at a pixel, 1 .. kMaxSurfaceDepth: the
    // nearest, exactly; triangles behind them are left out.
    uint32_t surface_depth = 8;
    // Also return, per pixel, the value behind it (MIP: the maximum; iso: the iso-value; meshes:
    // the label) and the distance in mm from the ray's start (iso, slices, meshes); NaN where there
    // is none.
    bool value_and_depth = false;

    friend bool operator==(const Scene&, const Scene&) = default;
};

// The voxels and meshes of a scene. Labels lie on a grid of their own, in the same world.
struct SceneData {
    Volume volume;
    std::optional<Volume> labels;                    // u8 or u16
    std::vector<std::shared_ptr<const Mesh>> meshes; // one a surface of the scene; null: it is live
    std::optional<Volume> fused{};                   // grey, of any type
    std::optional<Volume> overlay{};                 // more labels, u8 or u16
};

// How far a jittered ray's lattice begins before its start, in steps: 0 <= share < 1, a multiple of
// 2^-24. eye is 0, or 1 for the right one.
double jitter_share(uint32_t seed, glm::uvec2 pixel, uint32_t eye);

// From the volume to a light: a unit vector in the world's axes.
glm::dvec3 towards(const Light& light, const Camera& camera);

// The style of a label: the scene's own, or a generated colour that differs from its neighbours'.
LabelStyle style_of(const LabelLayer& layer, uint32_t label);

// The style of a label's triangles; of label 0 and of meshes without labels the layer's own.
SurfaceStyle style_of(const SurfaceLayer& layer, uint32_t label);
// The style of a label's triangles on a surface of live labels.
SurfaceStyle style_of(const SurfaceLayer& layer, const LabelLayer& labels, uint32_t label);

// The step a layer marches with: its own, or the smallest spacing where it leaves that open.
double step_mm_of(const RayCastLayer& layer, const Grid& grid);

// Fails where a ray along the diagonal of the volume would take more than 60000 steps: llvmpipe
// ends any loop after 65535 turns, which would cut the ray short.
Result<void> check_steps(const RayCastLayer& layer, const Grid& grid);

} // namespace palpate
