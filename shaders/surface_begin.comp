#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Before meshes are drawn: a pixel sees nothing, or a slice. One invocation a pixel.

#include "shaders/shared/surface.h"
#include "shaders/lib/surface.glsl"


layout(local_size_x = 64) in;

layout(scalar, binding = kSurfaceNearest) writeonly buffer Nearest { uvec2 nearest[]; };
#if HAS_THROUGH
layout(scalar, binding = kSurfaceThrough) writeonly buffer Through { uvec2 through[]; };
#endif
#if HAS_CLIPS
layout(scalar, binding = kSurfaceKept) writeonly buffer Kept { vec2 kept[]; };
layout(scalar, binding = kSurfaceCounts) writeonly buffer Counts { int counts[]; };
#endif
layout(binding = kSurfaceBehindValues) uniform sampler2DArray behind_values;

void main() {
    const uvec2 pixel = pixel_of(uvec2(gl_GlobalInvocationID.x, gl_WorkGroupID.y));
    if (!is_drawn(pixel))
        return;
    const uint place = place_of(pixel);
    const vec2 at = image_point(vec2(pixel));
    const float slice = texelFetch(behind_values, ivec3(pixel, frame.eye), 0).g; // NaN: none
    nearest[place] = slice > 0.0 && frame.clears == 0u ? key_of(slice / ray_mm(at), kSurfaceSlice) : kNothing;
#if HAS_THROUGH
    for (uint i = 0u; i < frame.depth; ++i)
        through[place * frame.depth + i] = kNothing;
#endif
#if HAS_CLIPS
    kept[place] = kept_stretch(at);
    for (uint i = 0u; i < 2u * frame.mesh_count; ++i)
        counts[place * 2u * frame.mesh_count + i] = 0;
#endif
}
