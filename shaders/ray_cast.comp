#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_vote : require

// The ray caster: one workgroup a listed tile, one invocation a pixel, one pass. Segments of one step
// each lie on a lattice that starts at the eye; only the first and the last are cut, and they are
// taken out of the loops. Loops are do-while, which all lanes of a subgroup leave together
// (docs/decisions/10-loops-that-lanes-leave.md), with the rare work outside, because software devices run
// every branch. Stretches of empty macro-cells are jumped over; what is marched is the same bit for
// bit without (lib/skipping.glsl).
//
// Built once for each combination of IS_ISO, HAS_LABELS, HAS_SLICES, HAS_VALUES, IS_EXACT and
// HAS_ATLAS (0 or 1), so that what a scene does not use needs no binding. With HAS_ATLAS one dispatch
// marches a part of the volume, and what rays have gathered is carried on to the next
// (lib/carry.glsl).
//
// Built without HAS_SLICES it is the variant for see-through meshes (HAS_LAYERS): rays are marched
// between their triangles (lib/ray_layers.glsl). These lie before slices and opaque meshes, if any.

#ifdef HAS_SLICES
#define HAS_LAYERS 0
#else
#define HAS_LAYERS 1
#define HAS_SLICES 1
#endif

#define HAS_FIRST_HITS (IS_ISO && !IS_EXACT && !HAS_LAYERS)

#include "shaders/shared/ray_cast.h"
#include "shaders/lib/rays.glsl"

layout(constant_id = 0) const uint kMode = kModeAlpha; // if not IS_ISO
layout(constant_id = 1) const uint kPreintegrated = 0u;
layout(constant_id = 2) const uint kShaded = 0u;
layout(constant_id = 3) const uint kHasNoData = 0u;   // samples may be NaN
layout(constant_id = 4) const uint kIsoCount = 1u;
layout(constant_id = 5) const uint kSkip = 1u;        // jump over empty space
layout(constant_id = 6) const uint kCount = 0u;       // write how many samples a tile took
layout(constant_id = 7) const uint kRays = kRaysAll;
layout(constant_id = 8) const uint kManual = 0u;      // interpolate by hand, in fp32
layout(constant_id = 9) const uint kStored = 0u;      // gradients are stored
layout(constant_id = 11) const uint kLight = 0u;      // it is not at the eye
#if IS_ISO
layout(constant_id = 12) const uint kOcclusion = 0u;  // ambient occlusion
#endif
#if HAS_LAYERS
layout(constant_id = 10) const uint kLayerCount = 1u;  // see-through triangles a pixel, at most
#endif

layout(local_size_x = 64) in;

layout(scalar, binding = kRayFrame) uniform FrameBlock { Frame frame; };
layout(binding = kRayVolume) uniform sampler3D volume;
#if !IS_ISO
layout(binding = kRayTable) uniform sampler1DArray table;
layout(binding = kRayGradients) uniform sampler3D gradients;
#endif
#if IS_EXACT
layout(binding = kRayCorners) uniform sampler3D corners;
#if !IS_ISO
layout(binding = kRaySmoothTable) uniform sampler1DArray smooth_table;
#endif
#endif
#if HAS_LABELS
layout(binding = kRayLabels) uniform usampler3D labels;
layout(scalar, binding = kRayStyles) readonly buffer Styles { vec4 styles[]; }; // rgb, visible
#endif
#if HAS_SLICES
layout(binding = kRayBehind) uniform sampler2DArray behind_color;
layout(binding = kRayBehindValues) uniform sampler2DArray behind_values; // (value, depth)
#endif
layout(binding = kRayColor, rgba32f) uniform writeonly image2DArray color_image;
#if HAS_VALUES
layout(binding = kRayValues, rg32f) uniform writeonly image2DArray value_image;
#endif

layout(binding = kRayCells) uniform sampler3D cells;
layout(scalar, binding = kRayTiles) buffer Tiles { TileEntry tiles[]; };
layout(scalar, binding = kRayTiles) readonly buffer Listed { uint listed_rays[]; };
layout(scalar, binding = kRayTileGroups) readonly buffer TileGroups {
    uint group_count; // of workgroups: tiles; of listed rays, as many as lie side by side
    uint rows[2];
    uint second_count; // of groups of four tiles; of listed rays
};
layout(scalar, binding = kRaySpans) readonly buffer Spans { vec2 spans[]; };

#if HAS_FIRST_HITS
layout(scalar, binding = kRayFirstHits) buffer FirstHits { float first_hits[]; };
#endif

#if !IS_ISO
layout(scalar, binding = kRaySlabs) readonly buffer Slabs { uint slabs[]; };
#endif
#if HAS_LAYERS
layout(binding = kRaySurfaces) uniform usampler2DArray surfaces;
#endif
#if HAS_ATLAS
layout(binding = kRayPages) uniform sampler3D pages;
layout(scalar, binding = kRayAtlas) uniform AtlasBlock { AtlasFrame atlas; };
layout(binding = kRayCarry, rgba32f) uniform image2DArray carry_image;
#endif

// Native kernels have slices and values always, and constants say whether they are in use.
#ifdef HAS_SLICES_ID
layout(constant_id = HAS_SLICES_ID) const bool kHasSlices = true;
#else
const bool kHasSlices = true;
#endif
#ifdef HAS_VALUES_ID
layout(constant_id = HAS_VALUES_ID) const bool kHasValues = true;
#else
const bool kHasValues = true;
#endif

#define kNaN uintBitsToFloat(0x7fc00000u)

uint samples_taken = 0u;
uint slab_words = 0u; // MIP: of the ray's tile
#if IS_ISO
vec3 cut_normal = vec3(0.0); // of the clip plane that the ray starts on, if any; mm per index
#endif
#if HAS_FIRST_HITS
float likely_start = 0.0; // mm from where the lattice begins: a listed ray is taken to meet nothing nearer
#endif

#include "shaders/lib/skipping.glsl"
#include "shaders/lib/mip_slab.glsl"
#include "shaders/lib/texels.glsl"
#include "shaders/lib/ray_sampling.glsl"
#include "shaders/lib/ray_modes.glsl"
#if IS_ISO
#include "shaders/lib/ray_cap.glsl"
#endif
#if HAS_FIRST_HITS
#include "shaders/lib/first_hits.glsl"
#endif
#if HAS_ATLAS
#include "shaders/lib/carry.glsl"
#endif
#if HAS_LAYERS
#include "shaders/lib/ray_layers.glsl"
#endif

// The list's order, taken alternately from its two halves' point of view: devices that give each
// thread one stretch of workgroups then have equal work for all.
uint entry_of(uint group, uint count) {
    const uint half_count = (count + 1u) / 2u;
    return group < half_count ? 2u * group : 2u * (group - half_count) + 1u;
}

void main() {
    uint entry;
    uvec2 place; // of the ray in its pass
    uint eye;
    vec2 span;
    bool wanted;
    if (kRays == kRaysListed) {
        const uint group = gl_WorkGroupID.x + kListedAcross * gl_WorkGroupID.y;
        entry = 64u * entry_of(group, (second_count + 63u) / 64u) + gl_LocalInvocationID.x;
        wanted = entry < second_count;
        const uint packed = listed_rays[wanted ? entry : 0u];
        eye = packed >> kTileEyeShift;
        place = uvec2(packed, packed >> kTileXBits) & ((1u << kTileXBits) - 1u);
    } else {
        uvec2 within;
        if (kRays == kRaysEverySecond) { // sixteen rays of each of four tiles
            entry = 4u * entry_of(gl_WorkGroupID.x, second_count) + gl_LocalInvocationID.x / 16u;
            wanted = entry < group_count;
            entry = wanted ? entry : 0u;
            within = second_pixel_in_tile(gl_LocalInvocationID.x);
        } else {
            entry = entry_of(gl_WorkGroupID.x, group_count);
            wanted = true;
            within = pixel_in_tile(gl_LocalInvocationID.x);
        }
        const TileEntry listed = tiles[entry];
        eye = listed.tile >> kTileEyeShift;
        const uvec2 tile = uvec2(listed.tile, listed.tile >> kTileXBits) & ((1u << kTileXBits) - 1u);
        place = tile * kTileSide + within;
        span = vec2(listed.near, listed.far);
        slab_words = slab_words_of(tile, eye, frame.rays);
        wanted = wanted && all(lessThan(place, frame.rays));
    }
    const vec2 pixel = frame.first_px + vec2(place) * frame.px_per_ray;
    if (kRays == kRaysListed || kRays == kRaysSparse) { // the picture's tiles know where to look
        const uvec2 tile = uvec2(pixel) / kTileSide;
        const uvec2 count = (frame.size_px + kTileSide - 1u) / kTileSide;
        span = spans[tile_number(tile, eye, count)];
        slab_words = slab_words_of(tile, eye, frame.size_px);
        wanted = wanted && span.x >= 0.0;
    }
    const Ray ray = ray_through(frame.eyes[eye], pixel, frame.size_px);

    vec2 t = clip_to_box(ray, frame.last);
    float cut = 0.0; // cosine between the ray and the normal of the clip plane it starts on, if any
    for (uint i = 0u; i < frame.clip_count; ++i) {
        const float before = t.x;
        t = clip_to_plane(ray, t, frame.clips[i]);
        cut = t.x > before ? abs(dot(frame.clips[i].normal, ray.direction)) : cut;
#if IS_ISO
        cut_normal = t.x > before ? frame.clips[i].normal : cut_normal;
#endif
    }
    vec4 behind = vec4(frame.background, 0.0);
#if HAS_SLICES
    vec2 behind_value = vec2(kNaN);
    if (kHasSlices) {
        behind = texelFetch(behind_color, ivec3(uvec2(pixel), eye), 0);
        behind_value = texelFetch(behind_values, ivec3(uvec2(pixel), eye), 0).rg;
        t.y = behind_value.g > 0.0 ? min(t.y, behind_value.g) : t.y;
    }
#endif
    const bool inside = t.x < t.y && wanted;
    t = inside ? t : vec2(0.0);

    // Distances are counted from where the lattice begins.
    const float jitter = frame.jitter_mm * jitter_share(frame.jitter_seed, uvec2(pixel), eye);
    const RaySampler s = ray_sampler(Ray(ray.origin - jitter * ray.direction, ray.direction));
    span += jitter;
#if HAS_FIRST_HITS
    if (kRays == kRaysListed)
        likely_start =
            nearest_hit_about(wanted ? place : uvec2(0u), eye) + jitter - kStepsBeforeHit * frame.step;
#endif
    t += jitter;
#if HAS_ATLAS
    const Carried front = carried(place, eye, wanted);
    const float start = t.x;
    t = clip_to_part(s.ray, eye, t);
    const bool marches = inside && t.x < t.y && !is_opaque(front);
    t = marches ? t : vec2(start);
    cut = t.x == start ? cut : 0.0; // a cap belongs to the part in which the ray starts
#else
    const bool marches = inside;
#endif
#if HAS_LAYERS
#if HAS_ATLAS
    float reached;
    const Marched before = carried_layers(front, wanted, reached);
    const float until = t.x < t.y ? max(reached, t.y) : reached;
    Marched marched =
        march_layers(s, t, vec2(reached, until), span, marches, cut, pixel, eye, jitter, before);
    carry_layers(marched, until, place, eye, wanted);
    marched = then_rest(marched, until, pixel, eye, jitter);
#else
    Marched marched = march_layers(s, t, vec2(0.0, kNoLayer), span, marches, cut, pixel, eye,
                                   jitter, Marched(vec4(0.0), kNaN, kNaN));
#endif
    marched.depth -= jitter;
#elif IS_ISO
    const Marched cap = cap_of(s, t.x, marches ? cut : 0.0);
    Marched marched = over(cap, march(s, t, span, marches && cap.color.a < 1.0));
    marched.depth -= jitter;
#else
    Marched marched = march(s, t, span, marches);
#endif
#if HAS_ATLAS && !HAS_LAYERS
    marched = carry_on(front, marched, place, eye, wanted);
#endif
#if HAS_FIRST_HITS
    if (kRays == kRaysEverySecond && wanted)
        leave_first_hit(place, eye, marched.depth);
#endif
    if (kCount != 0u && inside)
        atomicAdd(tiles[entry].samples, samples_taken);

    if (wanted) {
        const float transmittance = 1.0 - marched.color.a;
        imageStore(color_image, ivec3(place, eye),
                   vec4(marched.color.rgb + transmittance * behind.rgb,
                        marched.color.a + transmittance * behind.a));
#if HAS_VALUES
        if (kHasValues) {
            vec2 values = vec2(marched.value, marched.depth);
#if HAS_SLICES
            values = vec2(isnan(values.x) ? behind_value.x : values.x,
                          isnan(values.y) ? behind_value.y : values.y);
#endif
            imageStore(value_image, ivec3(place, eye), vec4(values, 0.0, 0.0));
        }
#endif
    }
}
