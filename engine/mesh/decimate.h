#pragma once

#include <cstdint>
#include <stop_token>

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"

namespace palpate {

struct DecimateOptions {
    double error_mm = 0.0;    // > 0: the Hausdorff distance to the original is at most this
    double least_share = 0.0; // stop at this share of the triangles, 0 .. 1
    std::stop_token stop;     // asked to stop, decimation ends with an error
};

struct Decimated {
    Mesh mesh;
    double hausdorff_mm = 0.0; // measured both ways between all points; <= error_mm
    uint32_t attempts = 0;
};

// A mesh of fewer triangles no farther from the original than error_mm.
//
// meshoptimizer collapses edges by the quadric error of Garland & Heckbert (1997), which bounds the
// distance to planes and not to the surface; so the result is measured, and where it is too far,
// the collapse starts again with less. Vertices are some of the original's, with their normals, in
// its order. Neither open edges nor non-manifold ones nor a change of the Euler number are added: a
// result with more of them is refused like one too far.
//
// Labels are kept: patches of one pair of labels are decimated on their own, the triangles along
// their rims fixed, so that walls still meet.
Result<Decimated> decimate(const Mesh& mesh, const DecimateOptions& options);

} // namespace palpate
