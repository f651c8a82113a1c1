#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Fills the picture between rays that lie `px_per_ray` pixels apart both ways, linearly: one
// invocation a row of the pixels between two rays, or beside the first. Tiles that were not marched
// are background, and stay.

#include "shaders/shared/interactive.h"
#include "shaders/lib/tile.glsl"

layout(local_size_x = kEnlargeGroup, local_size_y = kEnlargeGroup) in;

layout(scalar, binding = kEnlargeBlock) uniform Block { EnlargeBlock block; };
layout(binding = kEnlargeFew) uniform sampler2DArray few;
layout(binding = kEnlargeColor, rgba32f) uniform writeonly image2DArray color_image;
layout(scalar, binding = kEnlargeSpans) readonly buffer Spans { vec2 spans[]; };

vec4 few_at(int x, int y, uint eye) { return texelFetch(few, ivec3(x, y, eye), 0); }

void main() {
    const uint y = gl_GlobalInvocationID.y;
    const uint eye = gl_GlobalInvocationID.z;
    if (y >= block.size_px.y)
        return;
    const uvec2 tiles = (block.size_px + kTileSide - 1u) / kTileSide;
    const vec2 last = vec2(block.rays - 1u);
    const int ray = int(gl_GlobalInvocationID.x) - 1; // -1: left of the first
    const float down = clamp((float(y) - float(block.first_px.y)) / float(block.px_per_ray), 0.0, last.y);
    const ivec2 low = ivec2(clamp(ray, 0, int(last.x)), down);
    const ivec2 high = min(low + 1, ivec2(last));
    const vec4 upper_left = few_at(low.x, low.y, eye);
    const vec4 upper_right = few_at(high.x, low.y, eye);
    const vec4 lower_left = few_at(low.x, high.y, eye);
    const vec4 lower_right = few_at(high.x, high.y, eye);
    const int first = int(block.first_px.x) + ray * int(block.px_per_ray);
    for (uint i = 0u; i < block.px_per_ray; ++i) {
        const int x = first + int(i);
        const bool within = x >= 0 && x < int(block.size_px.x);
        const uvec2 pixel = uvec2(within ? uint(x) : 0u, y);
        const float across =
            clamp((float(x) - float(block.first_px.x)) / float(block.px_per_ray), 0.0, last.x);
        const vec4 upper = mix(upper_left, upper_right, across - float(low.x));
        const vec4 lower = mix(lower_left, lower_right, across - float(low.x));
        if (within && spans[tile_number(pixel / kTileSide, eye, tiles)].x >= 0.0)
            imageStore(color_image, ivec3(pixel, eye), mix(upper, lower, down - float(low.y)));
    }
}
