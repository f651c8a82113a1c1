#pragma once

#include <cstdint>
#include <vector>

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

constexpr uint16_t kGrowWall = 65535; // no data, or outside a region

// How steep the values of a volume are at each sample, as a rank: the share of all samples whose
// gradient (edge_strength) is smaller, 0 .. 65534 for 0 .. 1, or kGrowWall. x fastest, then y, then
// z. Ranks depend neither on the unit of the values nor on seeds. Gradients within 0.8 % of each
// other may share a rank. `region`, if any, is a label map of the volume's size: samples where it
// is 0 are walls and count in no share.
Result<std::vector<uint16_t>> grow_heights(const Volume& volume, const Volume* region,
                                           const Task& task);

} // namespace palpate
