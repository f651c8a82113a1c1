#pragma once

#include <string_view>

#include "engine/segment/brick_maker.h"

// Filters that change which samples a volume has. The patient does not move: world_from_index
// follows. Results have the type of the input. Memory: a brick of the result, and what it is made
// from, for each thread.
namespace palpate {

// Samples low .. high on each axis, both included, by index. Refused beyond the volume.
Result<BrickMaker> crop_bricks(const Volume& volume, glm::ivec3 low, glm::ivec3 high);

// `before` samples in front of the first and `after` behind the last on each axis (>= 0), with a
// value that the type holds.
Result<BrickMaker> pad_bricks(const Volume& volume, glm::ivec3 before, glm::ivec3 after,
                              double value);

// The order of samples along an index axis, 0 .. 2, reversed.
Result<BrickMaker> flip_bricks(const Volume& volume, int axis);

// Axes exchanged and reversed, so that they rise towards the sides of the patient that three
// letters name, one of L or R, P or A, S or I each: "LPS" as in DICOM, "RAS" as nibabel says it.
// Each axis goes to the letter to which it points most, all three together: turned grids stay
// turned.
Result<BrickMaker> reorient_bricks(const Volume& volume, std::string_view letters);

} // namespace palpate
