#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Fills the picture between rays that lie `px_per_ray` pixels apart both ways, linearly: one
// invocation a pixel. Tiles that were not marched are background, and stay.

#include "shaders/shared/interactive.h"
#include "shaders/lib/tile.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kEnlargeBlock) uniform Block { EnlargeBlock block; };
layout(binding = kEnlargeFew) uniform sampler2DArray few;
layout(binding = kEnlargeColor, rgba32f) uniform writeonly image2DArray color_image;
layout(scalar, binding = kEnlargeSpans) readonly buffer Spans { vec2 spans[]; };

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uint eye = gl_WorkGroupID.z;
    const uvec2 count = (block.size_px + kTileSide - 1u) / kTileSide;
    const uvec2 pixel = tile * kTileSide + pixel_in_tile(gl_LocalInvocationID.x);
    if (any(greaterThanEqual(pixel, block.size_px)) || spans[tile_number(tile, eye, count)].x < 0.0)
        return;
    const vec2 last = vec2(block.rays - 1u);
    const vec2 place =
        clamp((vec2(pixel) - vec2(block.first_px)) / float(block.px_per_ray), vec2(0.0), last);
    const ivec2 low = ivec2(place);
    const ivec2 high = min(low + 1, ivec2(last));
    const vec2 part = place - vec2(low);
    const vec4 upper = mix(texelFetch(few, ivec3(low, eye), 0),
                           texelFetch(few, ivec3(high.x, low.y, eye), 0), part.x);
    const vec4 lower = mix(texelFetch(few, ivec3(low.x, high.y, eye), 0),
                           texelFetch(few, ivec3(high, eye), 0), part.x);
    imageStore(color_image, ivec3(pixel, eye), mix(upper, lower, part.y));
}
