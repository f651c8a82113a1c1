#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Closes meshes where clip planes cut into what they enclose: where a ray enters what the planes
// keep, and where it leaves it. One invocation a pixel. Behind a point inside a closed mesh a ray
// leaves it once more than it enters it; of a label map's meshes the labels add up to the one that
// the point has.

#include "shaders/shared/surface.h"
#include "shaders/lib/surface.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kSurfaceStyles) readonly buffer Styles { SurfaceStyleEntry styles[]; };
layout(scalar, binding = kSurfaceNearest) buffer Nearest { uvec2 nearest[]; };
#if HAS_THROUGH
layout(scalar, binding = kSurfaceThrough) buffer Through { uvec2 through[]; };
#endif
layout(scalar, binding = kSurfaceKept) readonly buffer Kept { vec2 kept[]; };
layout(scalar, binding = kSurfaceCounts) readonly buffer Counts { int counts[]; };

// The cosine between the ray and the plane that its kept stretch begins or ends on.
float facing_of(vec2 at, float depth, bool entering) {
    const vec3 direction = ray_direction(at);
    float nearest_plane = kFarAway, facing = 1.0;
    for (uint i = 0u; i < frame.clip_count; ++i) {
        const SurfaceClip clip = frame.clips[i];
        const bool parallel = frame.orthographic != 0u;
        const vec3 point = parallel ? vec3(at, depth) : depth * vec3(at, 1.0);
        const float cosine = dot(clip.normal, direction);
        const float away = abs(dot(clip.normal, point) + clip.offset) / max(abs(cosine), 1e-30);
        const bool is_it = away < nearest_plane && (cosine > 0.0) == entering;
        nearest_plane = is_it ? away : nearest_plane;
        facing = is_it ? abs(cosine) : facing;
    }
    return facing;
}

void put(uint place, uvec2 key, float opacity) {
    if (opacity >= 1.0)
        nearest[place] = is_before(key, nearest[place]) ? key : nearest[place];
#if HAS_THROUGH
    if (opacity > 0.0 && opacity < 1.0)
        for (uint i = 0u; i < frame.depth; ++i) {
            const uvec2 was = through[place * frame.depth + i];
            const bool before = is_before(key, was);
            through[place * frame.depth + i] = before ? key : was;
            key = before ? was : key;
        }
#endif
}

// A cap lies this share of its distance before the plane, more than rounding: before what ray casting
// closes there.
const float kBefore = 7.6e-6;

void main() {
    const uvec2 pixel = pixel_of(uvec2(gl_GlobalInvocationID.x, gl_WorkGroupID.y));
    if (!is_drawn(pixel))
        return;
    const uint place = place_of(pixel);
    const vec2 at = image_point(vec2(pixel));
    const vec2 stretch = kept[place];
    if (stretch.x > stretch.y)
        return;
    for (uint end = 0u; end < 2u; ++end) {
        const float depth = end == 0u ? stretch.x : stretch.y;
        uint style = ~0u; // of the last mesh about this place
        for (uint m = 0u; m < frame.mesh_count; ++m) {
            const SurfaceMesh mesh = frame.meshes[m];
            const int inside = counts[2u * (place * frame.mesh_count + m) + end];
            const bool labelled = (mesh.flags & kSurfaceHasLabels) != 0u;
            const uint label = labelled ? min(uint(max(inside, 0)), mesh.style_count - 1u) : 0u;
            style = inside > 0 ? mesh.first_style + label : style;
        }
        if (style != ~0u && depth > 0.0 && depth < kFarAway)
            put(place, key_of((1.0 - kBefore) * depth, shaded(style, facing_of(at, depth, end == 0u))),
                styles[style].color.a);
    }
}
