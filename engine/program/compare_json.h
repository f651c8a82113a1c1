#pragma once

#include "engine/base/json.h"
#include "engine/image/compare.h"
#include "engine/mesh/distance.h"
#include "engine/volume/compare.h"

// The reports of `palpate compare` and of palpate.compare() in Python.
namespace palpate {

Json json_of(const SampleDifference& difference);
Json json_of(const ImageDifference& difference);

// The figures of volumes under the names that pictures have them.
SampleDifference samples_of(const VolumeDifference& difference, uint64_t count);

// Between which the Hausdorff distance lies, in mm.
struct HausdorffRange {
    double least, most;
};

// By how much the Hausdorff distance to a mesh may be off at first: 1e-4 of the mesh's extent.
double distance_tolerance_mm(const Mesh& mesh);

Json mesh_json(const Mesh& first, const Mesh& second, const MeshDistance& distance,
               HausdorffRange hausdorff);

} // namespace palpate
