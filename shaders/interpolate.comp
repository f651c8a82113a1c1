#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

// A picture from every second pixel both ways: one invocation a pixel. Between rays that agree the
// mean of the nearest ones is taken; the other pixels are listed for rays of their own. A listed
// pixel's place in the list says nothing: every ray fills its own pixel.

#include "shaders/shared/interactive.h"
#include "shaders/lib/rays.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kInterpolateBlock) uniform Block { InterpolateBlock block; };
layout(binding = kInterpolateCoarse) uniform sampler2DArray coarse;
layout(binding = kInterpolateColor, rgba32f) uniform writeonly image2DArray color_image;
layout(scalar, binding = kInterpolateGroups) buffer Groups {
    uint groups[3];
    uint ray_count;
};
layout(scalar, binding = kInterpolateRays) writeonly buffer Rays { uint rays[]; };

void main() {
    const uvec2 pixel = gl_WorkGroupID.xy * kTileSide + pixel_in_tile(gl_LocalInvocationID.x);
    const uint eye = gl_WorkGroupID.z;
    const uvec2 last = (block.size_px + 1u) / 2u - 1u;
    const uvec2 low = min(pixel / 2u, last);
    const uvec2 high = min(low + 1u, last);
    const vec4 a = texelFetch(coarse, ivec3(low, eye), 0);
    const vec4 b = texelFetch(coarse, ivec3(high.x, low.y, eye), 0);
    const vec4 c = texelFetch(coarse, ivec3(low.x, high.y, eye), 0);
    const vec4 d = texelFetch(coarse, ivec3(high, eye), 0);
    const bvec2 between = equal(pixel & 1u, uvec2(1u));
    const vec4 upper = between.x ? 0.5 * (a + b) : a;
    const vec4 lower = between.x ? 0.5 * (c + d) : c;
    const vec4 mean = between.y ? 0.5 * (upper + lower) : upper;
    const vec4 range = max(max(a, b), max(c, d)) - min(min(a, b), min(c, d));
    const float contrast = max(max(range.r, range.g), max(range.b, range.a));
    const bool inside = all(lessThan(pixel, block.size_px));
    const bool beyond = any(equal(low, high)) && any(between); // no ray on the other side
    const bool listed = inside && any(between) && (contrast > block.contrast || beyond);
    // One atomic addition for all lanes of a subgroup.
    const uint before = subgroupExclusiveAdd(listed ? 1u : 0u);
    const uint count = subgroupAdd(listed ? 1u : 0u);
    uint first = 0u;
    if (subgroupElect() && count > 0u) {
        first = atomicAdd(ray_count, count);
        const uint all = (first + count + 63u) / 64u; // workgroups of 64
        atomicMax(groups[0], min(all, kListedAcross));
        atomicMax(groups[1], (all + kListedAcross - 1u) / kListedAcross);
    }
    first = subgroupBroadcastFirst(first);
    if (listed)
        rays[first + before] = pixel.x | pixel.y << kTileXBits | eye << kTileEyeShift;
    else if (inside)
        imageStore(color_image, ivec3(pixel, eye), mean);
}
