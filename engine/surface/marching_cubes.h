#pragma once

#include <cstdint>
#include <stop_token>

#include "engine/mesh/mesh.h"
#include "engine/volume/volume.h"

namespace palpate {

enum class SurfaceTopology : uint8_t {
    classic, // inside corners lie apart on ambiguous faces; vertices on edges alone
    correct, // that of the trilinear interpolant: faces by their saddle, tubes where it has some
};

enum class SurfaceNormals : uint8_t {
    none,
    gradient,  // of the samples: central differences per mm, interpolated along the edge
    triangles, // of the mesh: vertex_normals()
};

struct SurfaceOptions {
    SurfaceTopology topology = SurfaceTopology::classic;
    SurfaceNormals normals = SurfaceNormals::gradient;
    // False: the surface ends where the samples do. True: what lies beyond them is outside, and a
    // wall 2^-12 of a sample before the outermost samples closes the mesh.
    bool closed_at_border = false;
    std::stop_token stop{}; // of marching_cubes(): asked to stop, the mesh is empty

    friend bool operator==(const SurfaceOptions&, const SurfaceOptions&) = default;
};

// Smallest distance of a vertex from the ends of its edge, as a share of the edge. So no two
// vertices coincide and no triangle has zero area, on up to 2048 samples an axis.
constexpr float kLeastFraction = 0x1p-12f;

// Work and time of an extraction.
struct SurfaceStages {
    uint64_t bricks = 0;         // of the volume
    uint64_t bricks_read = 0;    // whose samples were looked at
    uint64_t blocks_crossed = 0; // 8^3 blocks with vertices or triangles
    double signs_ms = 0.0, count_ms = 0.0, memory_ms = 0.0, emit_ms = 0.0;
};

// The surface where the trilinear interpolant of a volume equals `iso`, as triangles with shared
// vertices, facing where values are lower.
//
// A sample is inside where value >= iso. Vertices lie where the values along an edge of the lattice
// reach iso, in [2^-12, 1 - 2^-12] of the edge. The mesh is closed and manifold but for the border
// of the volume (see SurfaceOptions), for any values: ambiguous faces are decided from the face's
// own four samples.
//
// Samples without data are outside: the surface there is a wall 2^-12 of a sample from the data,
// and the normals of its vertices run along their edges. A size of 1 in an axis has no cells and so
// no triangles, unless closed_at_border. A flat field, an iso beyond the range of the volume, or
// NaN give an empty mesh (again but for a wall at the border). Where the gradient is zero, a normal
// runs along its edge.
//
// The mesh is a function of samples, grid, iso and options, to the bit, on any number of threads.
// Vertices and triangles come brick by brick (x fastest), in a brick block by block of 8^3 samples
// (x fastest), in a block sample by sample (x fastest): each sample owns the three edges that lead
// from it along x, y, z, and the cell whose lowest corner it is. A block's vertices within cells
// (mode `correct` alone) follow those on its edges.
//
// Throws std::length_error beyond 2^32 - 1 vertices, and SourceError where samples cannot be read.
Mesh marching_cubes(const Volume& volume, float iso, const SurfaceOptions& options = {},
                    SurfaceStages* stages = nullptr);

} // namespace palpate
