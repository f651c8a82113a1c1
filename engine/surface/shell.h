#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"

namespace palpate {

struct ShellOptions {
    double wall_mm = 2.0;                       // > 0: the wall's least thickness
    uint64_t max_samples = 256ull << 20;        // of the grid that distances are taken on
    std::stop_token stop;                       // asked to stop, hollowing ends with an error
    std::function<void(double share)> progress; // 0 .. 1, now and then; may be empty
};

struct Shell {
    Mesh mesh;              // the outer surface as it was, then that of the hollow
    double cell_mm = 0.0;   // of the grid
    double excess_mm = 0.0; // flat parts of the wall are thicker by this
    bool is_hollow = false; // else no part is thick enough, and the mesh is as it was
};

// Hollows what a closed mesh encloses, and leaves a wall: the inner surface is that of all points
// that are wall_mm from the outer one.
//
// Distances are exact at the samples of a grid of h, a third of the wall (or what max_samples
// allow, at most two thirds), and marching cubes find the inner surface between them, at wall_mm +
// excess_mm. No point of it is nearer to the outer surface than wall_mm: a distance t bends upwards
// by 1 / t at most, so that a vertex on an edge of the grid may be h^2 / (8 t) too near, and a
// point within a triangle, which is at most sqrt(3) h long, by another 3 h^2 / (8 t): in sum
// excess_mm = h^2 / (2 t). It bends downwards without limit: in the inner surface's creases the
// wall is thicker, by up to a cell.
//
// Inside is where the surface winds around a point more often than not. Normals, if the mesh has
// any, are those of the triangles in the hollow; labels are the first triangle's.
//
// Refused: a mesh that is not closed or not consistently oriented, a wall too thin for max_samples.
Result<Shell> hollowed(const Mesh& mesh, const ShellOptions& options);

} // namespace palpate
