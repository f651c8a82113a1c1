// The data that every pass of a frame reads: both eyes' rays, the volume's placement, clip planes.
#ifndef PALPATE_SHARED_FRAME_H
#define PALPATE_SHARED_FRAME_H
#include "shaders/shared/types.h"
GPU_BEGIN
const uint kMaxClips = 8u;
const uint kMaxIsoValues = 8u;
const uint kMaxSlices = 8u;

const uint kOrthographic = 1u; // FrameEye::projection
const uint kPerspective = 0u;

// One eye's rays in index space (sample (i, j, k) is at exactly (i, j, k)). Composed in double on
// the CPU; the GPU never sees world coordinates.
struct FrameEye {
    vec3 eye;           // index
    vec3 right;         // index per mm along the image's x axis
    vec3 up;            // index per mm
    vec3 forward;       // index per mm
    vec4 bounds;        // left, right, bottom, top of the image: tangents, or mm if orthographic
    uint projection;
    // How far, on any axis, the rays of a tile lie from the ray through its middle at equal
    // distances t: spread.x + spread.y * t samples. Farthest point of the volume: `reach` mm.
    vec2 spread;
    float reach;
};

struct ClipPlaneIndex {
    vec3 normal;        // mm per index: dot(normal, index) + offset is the distance in mm
    float offset;       // mm; the kept side is positive
};

struct Frame {
    FrameEye eyes[2];
    ClipPlaneIndex clips[kMaxClips];
    vec3 last;              // size - 1: the sampled box is [0, last], in index
    vec3 texture_from_index; // 1 / size
    mat3 world_from_index_covector; // turns a gradient per sample into one per mm
    // Label texture coordinates of an index position: label_scale * index + label_origin.
    mat3 label_from_index;
    vec3 label_origin;
    vec3 background;
    float value_scale, value_bias; // value = texel * value_scale + value_bias
    // Texture coordinate of a texel's value in the transfer table: texel * table_scale + table_bias.
    float table_scale, table_bias;
    vec4 table_first, table_last; // (rgb * tau, tau) of the table's ends
    // Macro-cells: how many less one, one over how many, and samples from face to face.
    vec3 cell_last;
    vec3 cell_texture;
    float cell_side;
    float cell_margin;      // texels: how far a sampled texel may lie above its cell's highest
    float mip_sign;         // MIP: 1 shows the largest value, -1 the smallest; texels and cells bear it
    float step;             // mm
    float sub_steps;        // exact: pieces of a cell at most
    float sub_steps_per_bend; // exact: pieces^2 by the table entries a second derivative amounts to
    float span_tolerance;   // exact: what a pixel may be off by for one sub-step
    float min_transmittance;
    float opacity_unit_mm;
    float label_weight;     // how far labels tint the ray-cast colour
    float label_opacity;    // of the fill on slices
    float outline_px;
    // The light, where it is not at the eye: its direction per mm in index space; and what gives its
    // cosine with a direction of 1 mm there.
    vec3 light_index;
    vec3 light_covector;
    mat3 index_from_world;  // of directions
    float occlusion_mm;     // radius of ambient occlusion
    vec4 shading;           // ambient, diffuse, specular, shininess
    float iso_texels[kMaxIsoValues];
    vec4 iso_colors[kMaxIsoValues]; // rgb, opacity
    uvec2 size_px;
    // The rays of a pass: ray r goes through pixel first_px + r * px_per_ray and fills texel r.
    uvec2 rays;
    vec2 first_px;
    float px_per_ray;
    uint clip_count;
    uint slice_count;
    uint style_count;       // entries of the style buffer
    float jitter_mm;        // rays' lattices begin up to this before their start; 0 for none
    uint jitter_seed;
};

// One plane through the volume.
struct SliceIndex {
    vec3 normal;            // mm per index, unit length in world
    float offset;           // dot(normal, index) + offset is the distance from the plane in mm
    vec3 normal_step;       // index between two samples of the slab, along the normal
    uint samples;           // of the slab, >= 1
    uint flags;             // kSlice...
};
const uint kSliceCubic = 1u;
const uint kSliceMaximum = 2u;
const uint kSliceMinimum = 4u;
GPU_END
#endif
