#pragma once

#include <cstdint>
#include <vector>

#include "engine/volume/volume.h"

namespace palpate {

// The grey values under the seeds of one label.
struct SeedValues {
    uint16_t label = 0;
    uint64_t count = 0; // samples that have data
    double mean = 0.0;
    double sd = 0.0; // of the samples, divided by count
};

// Of every label that seeds a sample with data, in ascending order. One size.
std::vector<SeedValues> seed_values(const Volume& volume, const Volume& seeds);

// sd, but not below a 500th of the volume's range of values: seeds on one value say nothing of how
// far values spread, and noise is not nothing. 1 where the volume has one value.
double spread_of(const SeedValues& values, const Volume& volume);

} // namespace palpate
