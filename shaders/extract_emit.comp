#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_vote : require

// Makes listed blocks: vertices, the numbers of their edges, and triangles, each where its job says.
// One workgroup a block.

#include "shaders/shared/extract.h"
#include "shaders/lib/extract_frame.glsl"
#include "shaders/lib/extract_block.glsl"
#include "shaders/lib/exact_float.glsl"

layout(local_size_x = 64) in;

layout(constant_id = 0) const uint kNormals = 1u; // 0: positions alone

layout(scalar, binding = kExtractCases) readonly buffer Cases { ExtractCase cases[]; };
layout(scalar, binding = kExtractJobs) readonly buffer Jobs {
    uint job_count;
    ExtractJob jobs[];
};
layout(scalar, binding = kExtractPositions) writeonly buffer Positions { vec3 positions[]; };
layout(scalar, binding = kExtractNormals) writeonly buffer Normals { vec3 normals[]; };
layout(scalar, binding = kExtractTriangles) writeonly buffer Triangles { uvec3 triangles[]; };
layout(scalar, binding = kExtractEdges) writeonly buffer Edges { uint edges[]; };

// Samples -1 .. 9 on each axis. With all else 15332 bytes of shared memory: every device has 16384.
shared uint value[11 * 11 * 11];
// The block's vertices: row << 5 | bit; and when they are made, the cells that the surface crosses:
// x | y << 3 | z << 6 | case << 9 | triangles before << 17.
shared uint entries[3 * 9 * 9 * 9];

#include "shaders/lib/extract_vertex.glsl"

void read_samples(uint lane, ivec3 block) {
    uint row = lane;
    do {
        if (row < 121u) {
            const int z = int(row * 373u >> 12), y = int(row) - 11 * z; // row / 11 below 121
            const ivec3 start = 8 * block + ivec3(-1, y - 1, z - 1);
            uint bits = 0u;
            for (int x = 0; x < 11; ++x) {
                const uint sample_bits = sample_at(start + ivec3(x, 0, 0));
                value[11u * row + uint(x)] = sample_bits;
                bits |= is_inside(sample_bits) ? 1u << x : 0u;
            }
            if (y >= 1 && y <= 9 && z >= 1 && z <= 9)
                inside_of_row[(y - 1) + 9 * (z - 1)] = bits >> 1 & 0x1ffu;
        }
        row += kExtractGroup;
    } while (subgroupAny(row < 121u));
}

void list_vertices(uint lane, uint own) {
    uint row = lane;
    do {
        if (row < 81u) {
            const int z = int(ninth(row)), y = int(row) - 9 * z;
            // As vertex_on() numbers them, counted on.
            const uint mask = own_bits(y, z), start = before_row[row];
            uint next_own = start & 0xffffu, next_borrowed = own + (start >> 16);
            uint left = edges_of_row[row];
            while (left != 0u) {
                const uint bit = uint(findLSB(left));
                const uint is_own = mask >> bit & 1u;
                entries[is_own != 0u ? next_own : next_borrowed] = row << 5 | bit;
                next_own += is_own;
                next_borrowed += 1u - is_own;
                left &= left - 1u;
            }
        }
        row += kExtractGroup;
    } while (subgroupAny(row < 81u));
}

void make_vertices(uint lane, ivec3 block, uint count, uint first, bool wanted) {
    uint i = lane;
    do {
        if (i < count) {
            const uint entry = entries[i];
            const uint row = entry >> 5, bit = entry & 31u;
            const uint x = bit * 11u >> 5, axis = bit - 3u * x; // bit / 3 below 32
            const uint z = ninth(row), y = row - 9u * z;
            const uint at = (x + 1u) + 11u * (y + 1u) + 121u * (z + 1u);
            const Vertex vertex = vertex_at(8 * block + ivec3(x, y, z), at, axis);
            if (wanted) {
                positions[first + i] = vertex.position;
                if (kNormals != 0u)
                    normals[first + i] = vertex.normal;
                edges[first + i] = 4u * ((x + 1u) + 12u * (y + 1u) + 132u * (z + 1u)) + axis;
            }
        }
        i += kExtractGroup;
    } while (subgroupAny(i < count));
}

// Returns how many cells the surface crosses.
uint list_cells(uint lane, ivec3 last) {
    const int y = int(lane & 7u), z = int(lane >> 3);
    uvec4 corners;
    const uint cells = crossed_cells(y, z, last, corners);
    uint triangles_here = 0u, left = cells;
    while (left != 0u) {
        triangles_here += cases[case_of(corners, uint(findLSB(left)))].high >> 28;
        left &= left - 1u;
    }
    uint total;
    const uint before = sum_before(lane, uint(bitCount(cells)) | triangles_here << 16, total);
    uint cell = before & 0xffffu, triangle = before >> 16;
    left = cells;
    while (left != 0u) {
        const uint x = uint(findLSB(left));
        const uint which = case_of(corners, x);
        entries[cell] = x | lane << 3 | which << 9 | triangle << 17;
        cell += 1u;
        triangle += cases[which].high >> 28;
        left &= left - 1u;
    }
    return total & 0xffffu;
}

// The vertex on edge e of a cell, as cell_edge() numbers them.
uint vertex_of_cell(uvec3 cell, uint e, uint own) {
    const uint axis = e >> 2, low = e & 1u, high = e >> 1 & 1u;
    const uvec3 corner = axis == 0u   ? uvec3(0u, low, high)
                         : axis == 1u ? uvec3(low, 0u, high)
                                      : uvec3(low, high, 0u);
    const uvec3 at = cell + corner;
    return vertex_on(int(at.y), int(at.z), 3u * at.x + axis, own);
}

// Their corners are numbered in the pool, where the block's vertices begin with `first_vertex`.
void make_triangles(uint lane, uint count, uint own, uint first_vertex, uint first, bool wanted) {
    uint i = lane;
    do {
        if (i < count) {
            const uint entry = entries[i];
            const uvec3 cell = uvec3(entry & 7u, entry >> 3 & 7u, entry >> 6 & 7u);
            const ExtractCase of = cases[entry >> 9 & 0xffu];
            const uint end = of.high >> 28;
            uint low = of.low, high = of.high; // the next corner's edge in the lowest bits
            uint k = 0u;
            do {
                const uvec3 triangle = uvec3(vertex_of_cell(cell, low & 15u, own),
                                             vertex_of_cell(cell, low >> 4 & 15u, own),
                                             vertex_of_cell(cell, low >> 8 & 15u, own));
                if (wanted && k < end)
                    triangles[first + (entry >> 17) + k] = first_vertex + triangle;
                low = low >> 12 | high << 20;
                high >>= 12;
                k += 1u;
            } while (subgroupAny(k < end));
        }
        i += kExtractGroup;
    } while (subgroupAny(i < count));
}

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint group = listed_group();
    const bool wanted = group < job_count;
    const ExtractJob job = jobs[min(group, job_count - 1u)];
    const ivec3 block = block_at(job.block);
    const ivec3 last = last_in(block);
    read_samples(lane, block);
    barrier();
    const uint numbers = number_edges(lane, last);
    barrier();
    const uint own = numbers & 0xffffu;
    list_vertices(lane, own);
    barrier();
    make_vertices(lane, block, own + (numbers >> 16), job.first_vertex, wanted);
    barrier();
    const uint cells = list_cells(lane, last);
    barrier();
    make_triangles(lane, cells, own, job.first_vertex, job.first_triangle, wanted);
}
