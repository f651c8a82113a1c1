#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "engine/measure/statistics.h"
#include "engine/volume/volume.h"

namespace palpate {

// The volume that one sample stands for, mm^3.
double sample_mm3(const Grid& grid);

// The samples of one label.
struct LabelStatistics {
    uint32_t label = 0;
    uint64_t count = 0;
    double volume_mm3 = 0.0;     // count samples
    glm::uvec3 low{0}, high{0};  // the box about them: first and last index on each axis
    glm::dvec3 centroid_mm{0.0}; // the mean of their centres
    // Second moments about the centroid, mm^2, of the samples as solid boxes: so a single one has
    // an extent.
    glm::dmat3 covariance_mm2{0.0};
    ValueStatistics values{}; // of the grey values there; of no sample without those
    // Grey values in bins of equal width from the volume's least to its greatest value, those at
    // the upper end in the last bin. Empty where it was not asked for.
    std::vector<uint64_t> histogram{};
};

// One entry for each label but 0 that the map carries, in rising order; none where it carries none.
//
// `grey` may lie on another grid in the same patient: then its values are interpolated linearly at
// the centres of the label map's samples, and those outside it have no data. Where the grids agree
// to a thousandth of a sample, its samples are taken as they are. Needs 4 bytes a labelled sample.
// `bins`: of each histogram; 0: none.
// Nothing where `stop` was asked.
std::optional<std::vector<LabelStatistics>> label_statistics(const Volume& labels,
                                                             const Volume* grey,
                                                             const std::stop_token& stop = {},
                                                             size_t bins = 0);

} // namespace palpate
