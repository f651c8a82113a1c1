#pragma once

#include "engine/segment/simplex_mesh.h"

namespace palpate {

// A deformable mesh that finds the boundary of an object from a first result, such as that of fast
// marching, as Nystroem et al. 2008 (sections 4 to 6) do: its external force is along the signed
// distance of that result, whose holes are filled before. A ball's topology and the mesh's rigidity
// keep it from following leaks.
struct MeshFitOptions {
    uint16_t label = 1;        // of the object in the first result
    uint32_t subdivisions = 4; // 0 .. 7: the mesh has 20 * 4^n vertices
    uint32_t steps = 400; // at most; fewer where no vertex moves by more than kStill of a sample
    // Above 0: then as many steps again to the strongest edges of the grey values within this range
    // along the normal, mm.
    double edges_mm = 0.0;
    SimplexOptions simplex{.rigidity = 1};
};
constexpr double kStill = 1e-3; // samples of the smallest spacing, in a step

struct MeshFit {
    SimplexMesh mesh;
    Volume labels;                   // u8 or u16: the label where the mesh is, on the result's grid
    uint32_t steps = 0;              // that were taken
    uint64_t self_intersections = 0; // pairs of triangles of triangles_of(mesh)
};

// The print does not say what the mesh begins as. Here it is the ellipsoid with the second moments
// of the object's core: the samples at least half as deep as the deepest, so that what is joined to
// the object by a narrow neck, or is thin, is not in it. `distance` is signed_distance() of the
// object, which must have samples.
SimplexMesh mesh_in_core(const Volume& distance, uint32_t subdivisions);

// Refused: an object without samples or one that fills the volume, and what signed_distance()
// refuses. `volume` is read where edges_mm > 0. Memory: the signed distance, 4 bytes a sample, and
// the mesh's.
Result<MeshFit> fit_mesh(const Volume& volume, const Volume& result, const MeshFitOptions& options,
                         const Task& task);

} // namespace palpate
