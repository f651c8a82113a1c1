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
    ValueStatistics values{};    // of the grey values there; of no sample without those
};

// One entry for each label but 0 that the map carries, in rising order; none where it carries none.
//
// `grey` may lie on another grid in the same patient: then its values are interpolated linearly at
// the centres of the label map's samples, and those outside it have no data. Where the grids agree
// to a thousandth of a sample, its samples are taken as they are. Needs 4 bytes a labelled sample.
// Nothing where `stop` was asked.
std::optional<std::vector<LabelStatistics>> label_statistics(const Volume& labels,
                                                             const Volume* grey,
                                                             const std::stop_token& stop = {});

} // namespace palpate
