#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// One step of smoothing, as smooth() of engine/surface/surface_nets.cpp has it, to the bit.

#include "shaders/shared/nets.h"
#include "shaders/lib/net_frame.glsl"
#include "shaders/lib/exact_float.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kNetVertices) readonly buffer Vertices { uint vertices[]; };
layout(scalar, binding = kNetLinks) readonly buffer Links { uint links[]; };
layout(scalar, binding = kNetOffsets) buffer Offsets { vec3 offsets[]; };

float divided(float a, float count) {
    const float size = exact_quotient(abs(a), count);
    return a < 0.0 ? -size : size;
}

float stepped(float here, float sum, float count, bool on_border) {
    precise const float away = divided(sum, count) - here;
    precise const float moved = frame.share * away;
    precise const float next = here + moved;
    const float kept = clamp(next, -frame.bound, frame.bound);
    return on_border ? 0.0 : kept;
}

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint group = listed_group();
    const bool wanted = group < job_count;
    const NetJob job = jobs[min(group, job_count - 1u)];
    const ivec3 block = block_at(job.block);
    for (uint begin = 0u; begin < job.vertices; begin += kNetGroup) { // the same for all lanes
        const uint i = begin + lane;
        const uint vertex = job.first_vertex + min(i, job.vertices - 1u);
        const ivec3 at = 8 * block + cell_in_block(vertices[vertex] & 511u);
        const vec3 here = offsets[frame.from + vertex];
        precise vec3 sum = vec3(0.0);
        uint count = 0u;
        for (uint n = 0u; n < kNetMostLinks; ++n) {
            const uint link = links[kNetMostLinks * vertex + n];
            const bool exists = link != kNetNoLink;
            const vec3 towards = vec3(unit((n >> 1) % 3u)) * (n < 6u ? -1.0 : 1.0);
            precise const vec3 there = offsets[frame.from + (exists ? link : vertex)] + towards;
            precise const vec3 with = sum + there;
            sum = exists ? with : sum;
            count += exists ? 1u : 0u;
        }
        const float divisor = float(max(count, 1u));
        const bvec3 on_border =
            bvec3(uvec3(equal(at, ivec3(0))) | uvec3(equal(at, frame.size)));
        const vec3 next = vec3(stepped(here.x, sum.x, divisor, on_border.x),
                               stepped(here.y, sum.y, divisor, on_border.y),
                               stepped(here.z, sum.z, divisor, on_border.z));
        if (wanted && i < job.vertices)
            offsets[frame.to + vertex] = count > 0u ? next : here;
    }
}
