#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

// Fills the picture between the rays of every second pixel both ways: one invocation a ray and the
// three pixels right of and below it, four tiles a workgroup. Between rays that agree the mean of the
// nearest ones is taken; beside others the three are listed for rays of their own. A listed pixel's
// place in the list says nothing: every ray fills its own pixel. Tiles that were not marched are
// background, and stay.

#include "shaders/shared/interactive.h"
#include "shaders/lib/tile.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kInterpolateBlock) uniform Block { InterpolateBlock block; };
layout(binding = kInterpolateColor, rgba32f) uniform image2DArray color_image;
layout(scalar, binding = kInterpolateSpans) readonly buffer Spans { vec2 spans[]; };
layout(scalar, binding = kInterpolateGroups) buffer Groups {
    uint groups[3];
    uint ray_count;
    uint marched_count; // of every second pixel
};
layout(scalar, binding = kInterpolateRays) writeonly buffer Rays { uint rays[]; };

vec4 color_at(uvec2 pixel, uint eye) { return imageLoad(color_image, ivec3(pixel, eye)); }

void store(uvec2 pixel, uint eye, vec4 color) { imageStore(color_image, ivec3(pixel, eye), color); }

float square(vec3 x) { return dot(x, x); }

// How far the mean of these may be from what lies between them: by as much as neighbours differ
// where that is an edge, and no mean of two fits a twist.
float contrast_among(vec3 a, vec3 b, vec3 c, vec3 d) {
    const float sides = square(a - b) + square(a - c) + square(b - d) + square(c - d);
    const vec3 twist = abs(a - b - c + d);
    return sqrt(sides * (1.0 / 12.0)) + 0.5 * max(twist.r, max(twist.g, twist.b));
}

void main() {
    const uvec2 count = (block.size_px + kTileSide - 1u) / kTileSide;
    const uvec2 tile = uvec2(4u * gl_WorkGroupID.x + gl_LocalInvocationID.x / 16u, gl_WorkGroupID.y);
    const uint eye = gl_WorkGroupID.z;
    const uint index = tile_number(uvec2(min(tile.x, count.x - 1u), tile.y), eye, count);
    const uvec2 low = tile * kTileSide + second_pixel_in_tile(gl_LocalInvocationID.x);
    const bool here = all(lessThan(low, block.size_px)) && spans[index].x >= 0.0;
    if (!subgroupAny(here))
        return;
    const uvec2 last = (block.size_px - 1u) & ~1u; // ray
    const uvec2 from = min(low, last);
    const uvec2 to = min(low + 2u, last);
    const vec4 a = color_at(from, eye);
    const vec4 b = color_at(uvec2(to.x, from.y), eye);
    const vec4 c = color_at(uvec2(from.x, to.y), eye);
    const vec4 d = color_at(to, eye);
    const float contrast = contrast_among(a.rgb, b.rgb, c.rgb, d.rgb);
    const bool beyond = any(equal(from, to)); // no ray on the other side
    const bvec2 inside = lessThan(low + 1u, block.size_px);
    const bool filled = here && contrast <= block.contrast && !beyond;
    if (filled) {
        const vec4 upper = 0.5 * (a + b);
        store(low + uvec2(1u, 0u), eye, upper);
        store(low + uvec2(0u, 1u), eye, 0.5 * (a + c));
        store(low + 1u, eye, 0.5 * (upper + 0.5 * (c + d)));
    }
    // One atomic addition for all lanes of a subgroup.
    const bvec2 listed = bvec2(uvec2(inside) * uint(here && !filled));
    const uint mine = uint(listed.x) + uint(listed.y) + uint(all(listed));
    const uint before = subgroupExclusiveAdd(mine);
    const uint all_lanes = subgroupAdd(mine);
    const uint marched = subgroupAdd(uint(here));
    if (subgroupElect())
        atomicAdd(marched_count, marched);
    uint first = 0u;
    if (subgroupElect() && all_lanes > 0u) {
        first = atomicAdd(ray_count, all_lanes);
        const uint all_groups = (first + all_lanes + 63u) / 64u; // workgroups of 64
        atomicMax(groups[0], min(all_groups, kListedAcross));
        atomicMax(groups[1], (all_groups + kListedAcross - 1u) / kListedAcross);
    }
    uint slot = subgroupBroadcastFirst(first) + before;
    const uint packed = low.x | low.y << kTileXBits | eye << kTileEyeShift;
    if (listed.x)
        rays[slot++] = packed + 1u;
    if (listed.y)
        rays[slot++] = packed + (1u << kTileXBits);
    if (all(listed))
        rays[slot] = packed + 1u + (1u << kTileXBits);
}
