#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/segment/seeds.h"
#include "engine/volume/volume.h"

namespace palpate {

// The grey values under the seeds of one label.
struct SeedValues {
    uint16_t label = 0;
    uint64_t count = 0; // samples that have data
    double mean = 0.0;
    double sd = 0.0; // of the samples, divided by count
};

// The values of every label that seeds a sample with data, in ascending order. One size.
//
// balls: where the seeds come from, if known. A ball that reaches over an edge has values of two
// kinds; those that its central sample is not of do not count. Two kinds: the split in two that
// leaves the least variance (Otsu 1979) has means more than four standard deviations of the halves
// apart. Even values over an interval have 3.5, a normal distribution 2.6.
std::vector<SeedValues> seed_values(const Volume& volume, const Volume& seeds,
                                    std::span<const SeedBall> balls = {});

// The first value of the upper kind, if ascending values fall into two kinds as above.
std::optional<float> upper_kind(const std::vector<float>& ascending);

// sd, but not below a 500th of the volume's range of values: seeds on one value say nothing of how
// far values spread, and noise is not nothing. 1 where the volume has one value.
double spread_of(const SeedValues& values, const Volume& volume);

} // namespace palpate
