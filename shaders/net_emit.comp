#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Vertices in millimetres and the triangles of walls, as surface_nets() makes them: of each cell the
// walls between its lowest corner and the ones beyond it.

#include "shaders/shared/nets.h"
#include "shaders/lib/net_frame.glsl"
#include "shaders/lib/net_cells.glsl"
#define GROUP_LANES kNetGroup
#include "shaders/lib/group_sums.glsl"

layout(local_size_x = 64) in;

layout(binding = kNetSamples) uniform usampler3D samples;
layout(scalar, binding = kNetVertices) readonly buffer Vertices { uint vertices[]; };
layout(scalar, binding = kNetOffsets) readonly buffer Offsets { vec3 offsets[]; };
layout(scalar, binding = kNetPositions) writeonly buffer Positions { vec3 positions[]; };
layout(scalar, binding = kNetTriangles) writeonly buffer Triangles { uvec3 triangles[]; };
layout(scalar, binding = kNetLabels) writeonly buffer Labels { uint labels[]; };

const float kApart = 0.25;

uint label_at(ivec3 at) {
    const ivec3 near = clamp(at, ivec3(0), frame.size - 1);
    const uint found = texelFetch(samples, near, 0).r;
    return at == near ? found : 0u;
}

vec3 place_of(ivec3 cell, uint vertex) {
    precise const vec3 at = vec3(cell) - 0.5 + offsets[frame.from + vertex];
    precise const vec3 place = at * frame.spacing_mm;
    return place;
}

float square(vec3 a, vec3 b) {
    precise const vec3 d = a - b;
    precise const float sum = d.x * d.x + d.y * d.y + d.z * d.z;
    return sum;
}

struct Wall {
    uint vertex[4];
    vec3 place[4];
    int cut[4];     // of side i, between corners i and i + 1: the face's corner that is cut off there,
                    // without the bit of its axis; -1: the side is not split
    uint across[4]; // and the face's axis
    uint sides;     // split ones
};

Wall wall_of(ivec3 at, uint axis) {
    const uint b = (axis + 1u) % 3u, c = (axis + 2u) % 3u;
    Wall wall;
    uint edge[4], splits[4];
    for (uint i = 0u; i < 4u; ++i) { // less (1, 1), (0, 1), (0, 0), (1, 0) on b and c
        const uint less_b = i == 0u || i == 3u ? 1u : 0u, less_c = i < 2u ? 1u : 0u;
        const ivec3 place = at - int(less_b) * unit(b) - int(less_c) * unit(c);
        const Cell cell = cell_at(place);
        edge[i] = edge_at(less_b << b | less_c << c, axis);
        splits[i] = cell.splits;
        wall.vertex[i] = vertex_on(cell, edge[i]);
        wall.place[i] = place_of(place, wall.vertex[i]);
    }
    wall.sides = 0u;
    for (uint side = 0u; side < 4u; ++side) {
        // Seen from the lower of the two cells, whose upper face it is.
        const uint across = side % 2u == 0u ? b : c;
        const uint lower = side < 2u ? side : (side + 1u) % 4u;
        const uint face = 2u * across + 1u, kind = splits[lower] >> 2u * face & 3u;
        const uint corner = corner_of(edge[lower]);
        int cut = -1;
        for (uint n = 0u; n < 2u; ++n) {
            const uint one = kFaceCorners[4u * face + ((kind + 3u & 3u) + 2u * n & 3u)];
            const bool is_it = one == corner || one == corner + (1u << axis);
            cut = kind != 0u && is_it ? int(one & ~(1u << across)) : cut;
        }
        wall.cut[side] = cut;
        wall.across[side] = across;
        wall.sides += cut >= 0 ? 1u : 0u;
    }
    return wall;
}

// Seen from the other side: corners 0, 3, 2, 1.
Wall turned(Wall wall) {
    Wall other = wall;
    other.vertex[1] = wall.vertex[3];
    other.vertex[3] = wall.vertex[1];
    other.place[1] = wall.place[3];
    other.place[3] = wall.place[1];
    for (uint side = 0u; side < 4u; ++side) {
        other.cut[side] = wall.cut[3u - side];
        other.across[side] = wall.across[3u - side];
    }
    return other;
}

uint triangles_of(Wall wall) { return wall.sides > 0u ? 4u + wall.sides : 2u; }
uint more_vertices_of(Wall wall) { return wall.sides > 0u ? 1u + wall.sides : 0u; }

void put(uint at, uvec3 triangle, uint pair) {
    triangles[at] = triangle;
    labels[at] = pair;
}

void emit_square(Wall wall, uint at, uint pair) {
    const bool across = square(wall.place[0], wall.place[2]) <=
                        square(wall.place[1], wall.place[3]); // the shorter diagonal
    put(at, uvec3(wall.vertex[0], wall.vertex[1], across ? wall.vertex[2] : wall.vertex[3]), pair);
    put(at + 1u, uvec3(across ? wall.vertex[0] : wall.vertex[1], wall.vertex[2], wall.vertex[3]),
        pair);
}

// A fan about the middle; a split side has a vertex of its own.
void emit_fan(Wall wall, uint at, uint vertex, uint pair) {
    precise const vec3 sum = ((wall.place[0] + wall.place[1]) + wall.place[2]) + wall.place[3];
    positions[vertex] = 0.25 * sum;
    uint next = vertex + 1u;
    uint rim[8];
    uint count = 0u;
    for (uint side = 0u; side < 4u; ++side) {
        rim[count] = wall.vertex[side];
        count += 1u;
        const bool is_split = wall.cut[side] >= 0;
        const uint cut = uint(max(wall.cut[side], 0)), axis = wall.across[side];
        vec3 towards = vec3(cut & 1u, cut >> 1 & 1u, cut >> 2) * 2.0 - 1.0;
        towards *= vec3(axis != 0u, axis != 1u, axis != 2u);
        precise const vec3 ends = wall.place[side] + wall.place[(side + 1u) % 4u];
        precise const vec3 aside = 0.5 * kApart * towards * frame.spacing_mm;
        precise const vec3 between = 0.5 * ends + aside;
        if (is_split)
            positions[next] = between;
        rim[min(count, 7u)] = is_split ? next : rim[min(count, 7u)];
        next += is_split ? 1u : 0u;
        count += is_split ? 1u : 0u;
    }
    for (uint i = 0u; i < 8u; ++i)
        if (i < count)
            put(at + i, uvec3(vertex, rim[i], rim[i + 1u < count ? i + 1u : 0u]), pair);
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
        if (wanted && i < job.vertices)
            positions[vertex] = place_of(at, vertex);
    }
    uint next_triangle = job.first_triangle, next_vertex = job.first_vertex + job.vertices;
    for (uint layer = 0u; layer < 8u; ++layer) {
        const ivec3 at = 8 * block + cell_in_block(lane + kNetGroup * layer);
        const uint crossed = cell_at(at).crossed;
        for (uint axis = 0u; axis < 3u; ++axis) {
            const bool is_wall = (crossed >> 4u * axis & 1u) != 0u;
            const uint low = label_at(at - 1), high = label_at(at - 1 + unit(axis));
            const Wall beyond = wall_of(at, axis);
            const Wall wall = high > low ? turned(beyond) : beyond;
            uint total;
            const uint counts =
                is_wall ? triangles_of(wall) | more_vertices_of(wall) << 16 : 0u;
            const uint before = sum_before(lane, counts, total);
            const uint triangle = next_triangle + (before & 0xffffu);
            const uint pair = max(low, high) | min(low, high) << 16;
            if (wanted && is_wall && wall.sides == 0u)
                emit_square(wall, triangle, pair);
            if (wanted && is_wall && wall.sides > 0u)
                emit_fan(wall, triangle, next_vertex + (before >> 16), pair);
            next_triangle += total & 0xffffu;
            next_vertex += total >> 16;
        }
    }
}
