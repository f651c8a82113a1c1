#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_vote : require

// Counts what each listed block holds. One workgroup a block.

#include "shaders/shared/extract.h"
#include "shaders/lib/extract_frame.glsl"
#include "shaders/lib/extract_block.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kExtractWork) readonly buffer Work { ExtractWork work; };
layout(scalar, binding = kExtractList) readonly buffer List { uint list[]; };
layout(scalar, binding = kExtractCounts) writeonly buffer Counts { ExtractCount counts[]; };
layout(scalar, binding = kExtractCases) readonly buffer Cases { ExtractCase cases[]; };

shared uint vertices, triangles; // of the block: sums, in which no order shows

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint entry = listed_group();
    const ivec3 block = block_at(list[min(entry, work.listed - 1u)]);
    const ivec3 last = last_in(block);
    if (lane == 0u) {
        vertices = 0u;
        triangles = 0u;
    }
    uint row = lane;
    do {
        if (row < 81u) {
            const uint z = ninth(row);
            const ivec3 start = 8 * block + ivec3(0, row - 9u * z, z);
            uint bits = 0u;
            for (int x = 0; x < 9; ++x)
                bits |= is_inside(sample_at(start + ivec3(x, 0, 0))) ? 1u << x : 0u;
            inside_of_row[row] = bits;
        }
        row += kExtractGroup;
    } while (subgroupAny(row < 81u));
    barrier();
    row = lane;
    do {
        if (row < 81u) {
            const int z = int(ninth(row)), y = int(row) - 9 * z;
            const uint edges = crossed_edges(y, z, last), own = own_bits(y, z);
            if (edges != 0u)
                atomicAdd(vertices,
                          uint(bitCount(edges & own)) | uint(bitCount(edges & ~own)) << 16);
        }
        row += kExtractGroup;
    } while (subgroupAny(row < 81u));

    uvec4 corners;
    uint left = crossed_cells(int(lane & 7u), int(lane >> 3), last, corners);
    uint in_row = 0u;
    while (left != 0u) {
        in_row += cases[case_of(corners, uint(findLSB(left)))].high >> 28;
        left &= left - 1u;
    }
    if (in_row != 0u)
        atomicAdd(triangles, in_row);
    barrier();
    if (lane == 0u && entry < work.listed)
        counts[entry] = ExtractCount(vertices, triangles);
}
