#pragma once

#include <cstdint>

#include "engine/volume/volume.h"

namespace palpate {

// 64 bits of all samples in their order, of size and type; not of the grid's place. Equal volumes
// have equal hashes on every machine, however their bricks are kept. No shield against malice.
// Reads everything, on all cores.
uint64_t content_hash(const Volume& volume);

} // namespace palpate
