#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// The work of walls in each cell of the blocks to make: the links of engine/surface/net_cell.cpp, and
// the cells' vertices where they begin.

#include "shaders/shared/nets.h"
#include "shaders/lib/net_frame.glsl"
#define NET_CELLS_WRITTEN
#include "shaders/lib/net_cells.glsl"
#define GROUP_LANES kNetGroup
#include "shaders/lib/group_sums.glsl"
#include "shaders/lib/exact_float.glsl"

layout(local_size_x = 64) in;

layout(binding = kNetSamples) uniform usampler3D samples;
layout(scalar, binding = kNetCells) writeonly buffer Cells { uvec2 cells[]; };
layout(scalar, binding = kNetVertices) writeonly buffer Vertices { uint vertices[]; };
layout(scalar, binding = kNetOffsets) writeonly buffer Offsets { vec3 offsets[]; };

shared uint label[729]; // of the samples from the one before the block on

const float kApart = 0.25; // of the way to a corner of the cell: engine/surface/surface_nets.cpp

void read_labels(uint lane, ivec3 block) {
    for (uint turn = 0u; turn < 12u; ++turn) {
        const uint i = lane + kNetGroup * turn;
        const ivec3 at = 8 * block - 1 + ivec3(i % 9u, i / 9u % 9u, i / 81u);
        const ivec3 near = clamp(at, ivec3(0), frame.size - 1);
        const uint found = texelFetch(samples, near, 0).r;
        if (i < 729u)
            label[i] = at == near ? found : 0u; // beyond the volume is background
    }
}

// Edges that belong together through a face, as bits: twice.
uvec2 links_of(uint f, uint l[8], uint crossed, out uint split) {
    const uint a = l[kFaceCorners[4u * f]], b = l[kFaceCorners[4u * f + 1u]];
    const uint c = l[kFaceCorners[4u * f + 2u]], d = l[kFaceCorners[4u * f + 3u]];
    uint edge[4];
    for (uint i = 0u; i < 4u; ++i)
        edge[i] = 1u << kFaceEdges[4u * f + i];
    const uint all_edges = edge[0] | edge[1] | edge[2] | edge[3];
    const bool all_crossed = (crossed & all_edges) == all_edges;
    const bool second = all_crossed && a == c && (b != d || a > b);
    const bool first = all_crossed && !second && b == d;
    split = first ? 1u : second ? 2u : 0u;
    if (first)
        return uvec2(edge[3] | edge[0], edge[1] | edge[2]);
    if (second)
        return uvec2(edge[0] | edge[1], edge[2] | edge[3]);
    return uvec2(crossed & all_edges, 0u);
}

vec3 first_offset(uint edges) {
    vec3 sum = vec3(0.0);
    for (uint e = 0u; e < 12u; ++e) {
        const uint corner = corner_of(e), axis = e >> 2;
        const vec3 middle = vec3(axis == 0u ? 0.5 : float(corner & 1u),
                                 axis == 1u ? 0.5 : float(corner >> 1 & 1u),
                                 axis == 2u ? 0.5 : float(corner >> 2));
        sum += (edges >> e & 1u) != 0u ? middle - 0.5 : vec3(0.0);
    }
    const vec3 size = kApart * abs(sum);
    const float count = float(bitCount(edges));
    const vec3 offset = vec3(exact_quotient(size.x, count), exact_quotient(size.y, count),
                             exact_quotient(size.z, count));
    return mix(offset, -offset, lessThan(sum, vec3(0.0)));
}

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint group = listed_group();
    const bool wanted = group < job_count;
    const NetJob job = jobs[min(group, job_count - 1u)];
    const ivec3 block = block_at(job.block);
    read_labels(lane, block);
    barrier();
    uint next = 0u; // vertex of the block
    for (uint layer = 0u; layer < 8u; ++layer) {
        const uint local = lane + kNetGroup * layer;
        const ivec3 in_block = cell_in_block(local);
        const bool exists = all(lessThanEqual(8 * block + in_block, frame.size));
        uint l[8];
        for (uint c = 0u; c < 8u; ++c) {
            const uvec3 at = uvec3(in_block) + uvec3(c & 1u, c >> 1 & 1u, c >> 2);
            l[c] = label[at.x + 9u * at.y + 81u * at.z];
        }
        uint crossed = 0u;
        for (uint e = 0u; e < 12u; ++e) {
            const uint corner = corner_of(e);
            crossed |= exists && l[corner] != l[corner + (1u << (e >> 2))] ? 1u << e : 0u;
        }
        uint links[12], splits = 0u;
        for (uint f = 0u; f < 6u; ++f) {
            uint split;
            const uvec2 two = links_of(f, l, crossed, split);
            links[2u * f] = two.x;
            links[2u * f + 1u] = two.y;
            splits |= split << 2u * f;
        }
        // Vertices in the order of their lowest edges: at most four.
        uint count = 0u, left = crossed, numbers = 0u;
        uint edges[4];
        for (uint v = 0u; v < 4u; ++v) {
            uint joined = left & (~left + 1u); // the lowest
            for (uint turn = 0u; turn < 11u; ++turn)
                for (uint i = 0u; i < 12u; ++i)
                    joined |= (joined & links[i]) != 0u ? links[i] : 0u;
            for (uint e = 0u; e < 12u; ++e)
                numbers |= (joined >> e & 1u) != 0u ? v << 2u * e : 0u;
            edges[v] = joined;
            count += joined != 0u ? 1u : 0u;
            left &= ~joined;
        }
        uint total;
        const uint first = next + sum_before(lane, count, total);
        next += total;
        if (wanted)
            cells[512u * job.slot + local] = packed(Cell(first, crossed, splits, numbers));
        for (uint v = 0u; v < 4u; ++v) {
            const vec3 offset = count > 1u ? first_offset(edges[v]) : vec3(0.0);
            if (wanted && v < count) {
                vertices[job.first_vertex + first + v] = local | edges[v] << 9;
                offsets[job.first_vertex + first + v] = offset;
            }
        }
    }
}
