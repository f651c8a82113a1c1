#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"

namespace palpate {

// What an edit replaced: for each changed brick both sides, shared with the snapshots they are of.
struct ReplacedBrick {
    ChangedBrick where;
    BrickPtr before, after;
};

// Reads no sample that the snapshots share; where others cannot be read, bricks count as changed.
std::vector<ReplacedBrick> replaced_bricks(const Volume& before, const Volume& after);

// A later snapshot than `after` that holds what `before`, the one it comes from, held. Reads no
// sample.
Volume taken_back(const Volume& before, const Volume& after);

// The difference of both sides, packed: leads from either to the other.
std::vector<std::byte> pack_step(const Volume& of, std::span<const ReplacedBrick> bricks);

// `now` with the packed difference taken: the other side. Fails where the bytes are not those of
// pack_step().
Result<Volume> apply_packed_step(const Volume& now, std::span<const std::byte> packed);

} // namespace palpate
