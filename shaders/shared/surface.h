// Meshes in a picture: bindings and blocks of the passes that find, for each pixel, the triangles its
// ray meets. A pixel keeps keys of 64 bits, the depth above what is met there, so that the smallest
// key is the nearest whatever the order in which they come.
#ifndef PALPATE_SHARED_SURFACE_H
#define PALPATE_SHARED_SURFACE_H
#include "shaders/shared/types.h"
GPU_BEGIN
const uint kMaxSurfaceLayers = 8u;
const uint kMaxSurfaceClips = 8u;

// The low half of a key.
const uint kSurfaceMeshShift = 28u;         // a triangle: number | leaving | mesh << 28. So of two
const uint kSurfaceLeaving = 1u << 27;      // at one depth the one that the ray enters is nearer.
const uint kSurfaceShaded = 0x80000000u;    // or what is seen of it: this | style << 16 | cosine
const uint kSurfaceStyleMask = 0x7fffu;     // between its normal and the ray, of 65535
const uint kSurfaceNone = 0xfffffffeu;      // or nothing
const uint kSurfaceSlice = 0xffffffffu;     // or a slice

const uint kSurfaceHasLabels = 1u;          // SurfaceMesh::flags
const uint kSurfaceHasNormals = 2u;
const uint kSurfaceHasOuterLabels = 8u;
const uint kSurfaceMirrored = 4u;           // its placement in the patient changes handedness

// A mesh as one eye sees it. Camera space: mm right, up and forward of the eye.
struct SurfaceMesh {
    mat3 camera_from_mesh;
    vec3 origin;              // of mesh space, in camera space
    mat3 covector_from_mesh;  // turns normals, to any length
    uint first_style;         // of label 0, which is not shown, or of all
    uint style_count;
    uint flags;
};

struct SurfaceClip {
    vec3 normal;              // unit, camera space: dot(normal, p) + offset is the distance in mm
    float offset;             // mm; the kept side is positive
};

// One eye's picture, or a part of it.
struct SurfaceFrame {
    SurfaceMesh meshes[kMaxSurfaceLayers];
    SurfaceClip clips[kMaxSurfaceClips];
    vec4 bounds;              // left, right, bottom, top of the image: tangents, or mm if orthographic
    uvec2 size_px;
    uint orthographic;        // 0 or 1
    uvec2 low_px, part_px;    // the first pixel that is drawn, and how many each way
    uint clears;              // 1: behind the surfaces lies `nothing`; 0: what the images hold
    vec4 nothing;             // colour of a ray that meets nothing
    uint eye;
    uint mesh_count, clip_count;
    uint depth;               // see-through triangles a pixel keeps
};

struct SurfaceStyleEntry {
    vec4 color;               // rgb, opacity
    vec4 shading;             // ambient, diffuse, specular, shininess
    float value;              // the label, or NaN
};

// The work that is drawn now: arrays of a mesh, which may have several. (0, 1, 1, 0, mesh, turn, first
// number, count, chunked) before its triangles are.
struct SurfaceWork {
    uint groups_x, groups_y, groups_z; // to draw what is listed
    uint listed;              // triangles over many pixels
    uint mesh;
    uint turn;                // kSurfaceDepths or kSurfaceNumbers; with 64 bits at a time the first alone
    uint first_number;        // in keys: of the first triangle of the arrays
    uint triangle_count;
    uint chunked;             // 1: workgroups draw the triangles that kSurfaceChunks lists
};

// Triangles of a surface that lie together, and a box about them in mesh space.
struct SurfaceBlock {
    uint first, count;
    vec3 low, high;
};

// The search for blocks that may be seen: (0, 1, 1, mesh, first, count, hides) before it.
struct SurfaceSearch {
    uint groups_x, groups_y, groups_z; // to draw what is found
    uint mesh;
    uint first, count;        // of the blocks
    uint hides;               // 1: what lies behind opaque surfaces that are drawn is left out
};
const uint kSurfaceDepths = 0u;
const uint kSurfaceNumbers = 1u;

const uint kSurfaceGroup = 64u;
const uint kSurfaceMostGroups = 32768u;     // across; devices have at least 65535
// Triangles over more pixels than this are drawn by a workgroup each.
const uint kSurfaceSmallPixels = 16u;

const uint kSurfaceFrame = 0u;
const uint kSurfaceStyles = 1u;             // SurfaceStyleEntry[]
const uint kSurfaceNearest = 2u;            // a key of 64 bits a pixel: of opaque triangles
const uint kSurfaceThrough = 3u;            // of the others, `depth` keys a pixel, sorted
const uint kSurfaceKept = 4u;               // vec2[]: depths between which the clip planes keep
const uint kSurfaceCounts = 5u;             // int[]: labels round either end of that, 2 a mesh a pixel
const uint kSurfacePositions = 6u;
const uint kSurfaceNormals = 7u;
const uint kSurfaceTriangles = 8u;
const uint kSurfaceLabels = 9u;             // uint[]: label, and the outer one << 16
const uint kSurfaceWork = 10u;              // SurfaceWork, also read as the groups of a dispatch
const uint kSurfaceLarge = 11u;             // uint[]: triangles over many pixels
const uint kSurfaceBehind = 12u;            // colour behind all rays
const uint kSurfaceBehindValues = 13u;      // (value, distance in mm); NaN where there is none
const uint kSurfaceColor = 14u;             // the picture without ray casting
const uint kSurfaceValues = 15u;
const uint kSurfaceChunks = 17u;            // uvec2[] a workgroup: the first triangle, one past the last
const uint kSurfaceBlocks = 18u;            // SurfaceBlock[]: the nearest first
const uint kSurfaceSearch = 19u;            // SurfaceSearch, also read as the groups of a dispatch
const uint kSurfaceLayers = 16u;            // what lies in the rays' way: `depth` layers an eye
GPU_END
#endif
