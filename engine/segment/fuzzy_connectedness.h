#pragma once

#include "engine/segment/seed_values.h"
#include "engine/segment/task.h"

namespace palpate {

struct Affinity {
    double mean = 0.0;        // of the object's values
    double sd = 1.0;          // of the object's values, > 0
    double homogeneity = 1.0; // standard deviation of differences of neighbours, > 0
    double weight = 0.5;      // of homogeneity, 0 .. 1; the rest is the object's
};

// Fuzzy connectedness of every sample to the seeds of a label (Udupa & Samarasekera 1996): the
// greatest strength of a path, where a path is as strong as its weakest step, and a step between
// neighbours with a common face has the affinity
//     weight * exp(-(a - b)^2 / (2 homogeneity^2)) + (1 - weight) * exp(-((a + b) / 2 - mean)^2 /
//     (2 sd^2)).
// f32, 1 at seeds; no data where the volume has none, or behind it. Any threshold of it is a
// segmentation: one run answers all. Exact: affinities are floats, and the order of samples is no
// matter. Memory: 5 to 6 bytes a sample beside volume and result.
Result<Volume> fuzzy_connectedness(const Volume& volume, const Volume& seeds, uint16_t label,
                                   const Affinity& affinity, const Task& task);

} // namespace palpate
