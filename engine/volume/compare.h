#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate {

// How far the second volume is from the first, sample by sample in stored order.
//
// Two samples are the same when both are equal numbers or both are "no data". Where just one has
// data they are counted in `nan_mismatch` and in `differing`, and stay out of the other figures,
// which are 0 where nothing could be measured.
struct VolumeDifference {
    double geometry_mm = 0.0; // how far apart the same corner of the two grids lies, at most
    bool same_type = true;    // stored alike
    double max_abs = 0.0;     // in value units, as are the next two
    double rmse = 0.0;
    double mean_signed = 0.0;  // second minus first
    uint64_t differing = 0;    // samples that differ by more than the bound, and nan_mismatch
    uint64_t nan_mismatch = 0; // samples
};

// bound >= 0, in value units. An error when the sizes differ.
Result<VolumeDifference> compare_volumes(const Volume& first, const Volume& second, double bound);

// How well two label maps agree on one label. With A and B the sets of voxels that carry it:
struct LabelAgreement {
    uint32_t label = 0;
    uint64_t first = 0, second = 0, both = 0; // voxels in A, in B, in A and B

    double dice() const { return 2.0 * double(both) / double(first + second); }
    double jaccard() const { return double(both) / double(first + second - both); }
};

// One entry for each label but 0 that either map carries, in rising order. Samples must be whole
// numbers in 0 .. 65535, as io's load_labels() gives them. An error when the sizes differ.
Result<std::vector<LabelAgreement>> compare_labels(const Volume& first, const Volume& second);

} // namespace palpate
