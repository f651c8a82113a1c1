#pragma once

#include <vector>

#include "engine/volume/volume.h"

namespace palpate {

struct ChangedBrick {
    glm::uvec3 position; // in bricks
    uint64_t blocks;     // bit b: some sample of 8x8x8 block b differs; never 0

    friend bool operator==(const ChangedBrick&, const ChangedBrick&) = default;
};

// The box [low, high) about a brick's changed blocks, in samples of the brick: 0 .. kBrickSide.
// It may reach beyond the volume.
struct BrickBox {
    glm::uvec3 low, high;
};
BrickBox changed_samples(const ChangedBrick& brick);

// The bricks in which two snapshots of one volume differ, in x-fastest order.
//
// The only list of changes: upload, meshing, min-max and touch all read it. Pages and bricks that
// the snapshots share are skipped by pointer, so the cost follows the edit. Both have one size; of
// two types (labels that grew from u8 to u16) no brick is shared, and all are compared by value.
std::vector<ChangedBrick> changed_bricks(const Volume& before, const Volume& after);

struct ChangedBox { // samples first .. last on each axis, of the volume
    glm::ivec3 first, last;
};
// Boxes about the samples of a changed brick that differ, one for each of its changed blocks.
std::vector<ChangedBox> changed_boxes(const Volume& before, const Volume& after,
                                      const ChangedBrick& brick);

} // namespace palpate
