#pragma once

#include <span>

#include "engine/volume/volume.h"

namespace palpate {

// The levels of a volume, each half as fine as the one before on every axis that has more than one
// sample. Sample i of a level is made of samples 2i and 2i + 1 of the finer one.
enum class Reduction {
    mean,  // of the (up to eight) samples that have data, rounded to the nearest value of the type
    first, // sample 2i: for labels, which have no mean
};

// The grid one level coarser. A sample lies in the middle of those it is made of, so the sampled
// box shrinks by half a coarse sample at most.
Grid coarser_grid(const Grid& grid);

// Levels of a volume of this size: 1 where it is one brick, else until it is.
uint32_t level_count(glm::uvec3 size);

// Writes one brick's part of the next level: its octant of a coarse brick's kBrickSamples samples.
// position and valid are the fine brick's; T is the stored type of both.
template <class T>
void reduce_brick(const Brick& fine, glm::uvec3 position, glm::uvec3 valid, Reduction reduction,
                  std::span<T> coarse);

} // namespace palpate
