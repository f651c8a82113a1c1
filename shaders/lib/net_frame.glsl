// The passes of nets share the frame, jobs, and how cells, edges and faces are numbered
// (engine/surface/cell_tables.h).

layout(scalar, binding = kNetFrame) uniform Frame { NetFrame frame; };
layout(scalar, binding = kNetJobs) readonly buffer Jobs {
    uint job_count;
    NetJob jobs[];
};

uint listed_group() { return gl_WorkGroupID.x + kNetMostGroups * gl_WorkGroupID.y; }

ivec3 block_at(uint number) {
    const uvec3 n = frame.blocks;
    return ivec3(number % n.x, number / n.x % n.y, number / (n.x * n.y));
}

ivec3 cell_in_block(uint local) { return ivec3(local & 7u, local >> 3 & 7u, local >> 6); }

// The corners of face f in turn, and its edges: edge i lies between corners i and i + 1.
const uint kFaceCorners[24] = uint[24](4u, 6u, 2u, 0u, 1u, 3u, 7u, 5u, 1u, 5u, 4u, 0u,
                                       2u, 6u, 7u, 3u, 2u, 3u, 1u, 0u, 4u, 5u, 7u, 6u);
const uint kFaceEdges[24] = uint[24](6u, 10u, 4u, 8u, 5u, 11u, 7u, 9u, 9u, 2u, 8u, 0u,
                                     10u, 3u, 11u, 1u, 1u, 5u, 0u, 4u, 2u, 7u, 3u, 6u);

// The corner at an edge's lower end.
uint corner_of(uint e) {
    const uint axis = e >> 2, low = e & 1u, high = e >> 1 & 1u;
    return axis == 0u ? 2u * low + 4u * high : axis == 1u ? low + 4u * high : low + 2u * high;
}

// The edge along `axis` from a corner.
uint edge_at(uint corner, uint axis) {
    const uint x = corner & 1u, y = corner >> 1 & 1u, z = corner >> 2;
    return 4u * axis + (axis == 0u ? y + 2u * z : axis == 1u ? x + 2u * z : x + 2u * y);
}

ivec3 unit(uint axis) { return ivec3(axis == 0u, axis == 1u, axis == 2u); }
