#pragma once

#include <cstdint>

#include "engine/segment/seeds.h"
#include "engine/segment/task.h"

namespace palpate {

// How a simulated person places balls of seeds in an object that is known, for trials that can be
// repeated. Not an ideal person: centres and radii are off, and some balls lie outside.
struct SimulatedSeedOptions {
    uint16_t label = 1;     // of the object in the label map, and of its seeds; >= 1
    uint32_t count = 3;     // of balls, >= 1
    double radius_mm = 8.0; // > 0
    double jitter_mm = 3.0; // standard deviation of a centre along each axis, >= 0
    double radius_sd = 0.1; // standard deviation of a radius, as a share of it, >= 0
    double mistakes = 0.05; // chance that a centre that falls outside the object stays, 0 .. 1
    uint64_t random = 1;    // seed of the random numbers
};

// Places lie 1.2 radii deep in the object, or half as deep as its deepest one where that is less:
// the first anywhere, each next one the farthest from all before of 64 that are drawn. Centres are
// then moved by the jitter, and radii change by their deviation, within 50 and 150 %.
// The file names the grid of the map. The same seeds on every machine. Refused: a label that the
// map has not, and what signed_distance() refuses.
Result<SeedFile> simulated_seeds(const Volume& labels, const SimulatedSeedOptions& options,
                                 const Task& task);

} // namespace palpate
