#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <stop_token>

#include "engine/base/error.h"
#include "engine/mesh/edge_collapse.h"
#include "engine/mesh/mesh.h"

namespace palpate {

struct DecimateOptions {
    // > 0: the Hausdorff distance to the original is at most this. Infinite: the count decides.
    double error_mm = std::numeric_limits<double>::infinity();
    uint64_t least_triangles = 0;               // ends when no more than these are left
    std::stop_token stop;                       // asked to stop, decimation ends with an error
    std::function<void(double share)> progress; // 0 .. 1, now and then; may be empty
};

struct Decimated {
    Mesh mesh;
    double hausdorff_mm = 0.0; // an upper bound, measured both ways for all points; <= error_mm
    KeptEdges kept;            // why edges are left, where least_triangles was not reached
};

// A mesh of fewer triangles no farther from the original than error_mm.
//
// Edges collapse in order of least displacement of the surface, and only if no point of either
// surface ends farther from the other than error_mm (edge_collapse.h). New vertices minimise the
// distance to the planes of the original's triangles and take the original's normal there.
// Distances hold for each patch of one label and one outer label against the same patch. They are
// measured once more on the result.
//
// Every component keeps its Euler number, so none appears or vanishes, and no open or non-manifold
// edge is added. Lines where walls between labels meet stay lines, and no wall splits. The
// triangles keep their order and labels. Triangles that name a vertex twice are dropped.
//
// Refused: an error_mm that is not above 0; what check_mesh() refuses.
Result<Decimated> decimate(const Mesh& mesh, const DecimateOptions& options);

} // namespace palpate
