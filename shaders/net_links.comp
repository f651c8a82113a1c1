#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Which vertices each one moves towards, in the order of engine/surface/net_layers.cpp: through the
// lower faces of its cell, then through the upper ones. On lines where several walls meet, along them.

#include "shaders/shared/nets.h"
#include "shaders/lib/net_frame.glsl"
#include "shaders/lib/net_cells.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kNetVertices) readonly buffer Vertices { uint vertices[]; };
layout(scalar, binding = kNetLinks) writeonly buffer Links { uint links[]; };

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint group = listed_group();
    const bool wanted = group < job_count;
    const NetJob job = jobs[min(group, job_count - 1u)];
    const ivec3 block = block_at(job.block);
    for (uint begin = 0u; begin < job.vertices; begin += kNetGroup) { // the same for all lanes
        const uint i = begin + lane;
        const uint vertex = job.first_vertex + min(i, job.vertices - 1u);
        const uint info = vertices[vertex], edges = info >> 9;
        const ivec3 at = 8 * block + cell_in_block(info & 511u);
        const Cell here = cell_at(at);
        uint found[kNetMostLinks];
        uint lines = 0u; // bit: that link is one
        for (uint d = 0u; d < 6u; ++d) {
            const uint axis = d % 3u;
            const bool upper = d >= 3u;
            const Cell there = cell_at(at + (upper ? unit(axis) : -unit(axis)));
            // The face as the cell above it has it.
            const uint crossed = upper ? there.crossed : here.crossed;
            const uint kind = (upper ? there.splits : here.splits) >> 4u * axis & 3u;
            uint count = 0u, any = 0u;
            for (uint n = 0u; n < 4u; ++n) {
                const uint e = kFaceEdges[8u * axis + n];
                const bool is_crossed = (crossed >> e & 1u) != 0u;
                count += is_crossed ? 1u : 0u;
                any = is_crossed ? e : any;
            }
            for (uint n = 0u; n < 2u; ++n) {
                const uint corner = (kind + 3u & 3u) + 2u * n; // kind - 1, kind + 1
                const uint high = kind == 0u ? any : kFaceEdges[8u * axis + (corner & 3u)];
                const uint low = edge_at(corner_of(high) | 1u << axis, high >> 2);
                const bool exists = count > 0u && (kind != 0u || n == 0u);
                const bool is_mine = exists && (edges >> (upper ? low : high) & 1u) != 0u;
                const bool is_line = is_mine && kind == 0u && count > 2u;
                found[2u * d + n] = is_mine ? vertex_on(there, upper ? high : low) : kNetNoLink;
                lines |= is_line ? 1u << 2u * d + n : 0u;
            }
        }
        for (uint n = 0u; n < kNetMostLinks; ++n)
            if (wanted && i < job.vertices)
                links[kNetMostLinks * vertex + n] =
                    lines == 0u || (lines >> n & 1u) != 0u ? found[n] : kNetNoLink;
    }
}
