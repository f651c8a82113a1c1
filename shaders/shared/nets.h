// Walls between the labels of a volume on the GPU: bindings and blocks of the passes that make what
// engine/surface/surface_nets.h describes, block by block of 8^3 cells. One workgroup a block.
#ifndef PALPATE_SHARED_NETS_H
#define PALPATE_SHARED_NETS_H
#include "shaders/shared/types.h"
GPU_BEGIN
const uint kNetGroup = 64u;                 // invocations of every pass
const uint kNetMostGroups = 32768u;         // across; devices have at least 65535
const uint kNetMostLinks = 12u;             // of a vertex: two through each face of its cell
const uint kNetNoLink = 0xffffffffu;

// Cells are 0 .. size on each axis, cell c between the samples c - 1 and c. Block (0, 0, 0) begins
// with cell (0, 0, 0); blocks are numbered x fastest.
struct NetFrame {
    ivec3 size;               // samples of the volume
    uvec3 blocks;             // on each axis
    vec3 spacing_mm;
    float bound;              // most a vertex moves on each axis, in samples
    float share;              // of the way to the mean of its neighbours: of one step
    uint from, to;            // the first offset that the step reads, and that it writes
};

// A block to make: vertices and triangles of its own from these places on.
struct NetJob {
    uint block;
    uint slot;                // of its cells, 512 each
    uint first_vertex, vertices; // those that cells have; those of split walls follow
    uint first_triangle;
};

// The place of a block with walls; slot is one more than the block's, 0 where it has none.
struct NetPlace {
    uint slot;
    uint first_vertex;
};

const uint kNetFrame = 0u;
const uint kNetSamples = 1u;                // usampler3D
const uint kNetJobs = 2u;                   // their number, and NetJob[]
const uint kNetPlaces = 3u;                 // NetPlace[] of every block
const uint kNetCells = 4u;                  // uvec2[], see lib/net_cells.glsl
const uint kNetVertices = 5u;               // uint[]: cell in its block | crossed edges << 9
const uint kNetOffsets = 6u;                // vec3[]: from the centre of the cell, in samples
const uint kNetLinks = 7u;                  // uint[], kNetMostLinks of each vertex
const uint kNetPositions = 8u;              // vec3[], mm
const uint kNetTriangles = 9u;              // uvec3[]: vertices, by their places
const uint kNetLabels = 10u;                // uint[] of triangles: label | outer label << 16
GPU_END
#endif
