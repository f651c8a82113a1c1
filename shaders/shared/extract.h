// Extraction of a surface on the GPU: bindings and blocks of the passes that find the blocks of 8^3
// samples which the surface crosses, count what each holds, and make it. One workgroup a block; what
// comes out does not depend on which is done first.
#ifndef PALPATE_SHARED_EXTRACT_H
#define PALPATE_SHARED_EXTRACT_H
#include "shaders/shared/types.h"
GPU_BEGIN
const uint kExtractGroup = 64u;             // invocations of every pass
const uint kExtractMostGroups = 32768u;     // across; devices have at least 65535

// Blocks are numbered x fastest from block (-lead, -lead, -lead) on; block (0, 0, 0) begins with
// sample (0, 0, 0).
struct ExtractFrame {
    ivec3 size;               // samples of the volume
    ivec3 last;               // the last sample that has cells: size - 1, one more if `closed`
    uvec3 blocks;             // on each axis
    uint lead;                // blocks before the volume: 1 if `closed`, else 0
    uint closed;              // 1: beyond the volume there is no data; 0: the nearest sample again
    uint is_float;            // 1: texels are the bits of floats; 0: integers, each more by `bias`
    int bias;
    int iso_order;            // of the iso-value, see sample_order()
    float iso;
    vec3 spacing_mm;
    vec3 normal_scale;        // 0.5 / spacing_mm: differences across two samples to slopes
};

// The range of a block's samples, as sample_order()s. A block without data is (highest,
// lowest); one of a brick in which some are missing has the lowest as its least.
struct ExtractRange {
    int least, most;
};

// How many blocks are listed, and the groups of a dispatch of one each.
struct ExtractWork {
    uint groups_x, groups_y, groups_z;
    uint listed;
};

// The contents of a block: vertices on edges of its own samples, | those on its neighbours' << 16; and
// triangles.
struct ExtractCount {
    uint vertices;
    uint triangles;
};

// A block to make, and where in the pool.
struct ExtractJob {
    uint block;
    uint first_vertex, first_triangle;
};

// The triangles of a case: the edges of their corners, four bits each, and in the four highest bits
// of `high` their number.
struct ExtractCase {
    uint low, high;
};

const uint kExtractFrame = 0u;
const uint kExtractSamples = 1u;            // usampler3D
const uint kExtractRanges = 2u;             // ExtractRange[] of every block of the volume, x fastest
const uint kExtractSums = 3u;               // uint[]: of each group, blocks listed by it, then before it
const uint kExtractWork = 4u;               // ExtractWork, also read as the groups of a dispatch
const uint kExtractList = 5u;               // uint[]: numbers of blocks, rising
const uint kExtractCounts = 6u;             // ExtractCount[] of the listed blocks
const uint kExtractCases = 7u;              // ExtractCase[256]
const uint kExtractJobs = 8u;               // their number, and ExtractJob[]
const uint kExtractPositions = 9u;          // vec3[], mm
const uint kExtractNormals = 10u;           // vec3[]
const uint kExtractTriangles = 11u;         // uvec3[]: vertices, by their places
const uint kExtractEdges = 12u;             // uint[]: block::edge_number() of each vertex
GPU_END
#endif
