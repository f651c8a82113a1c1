#pragma once

#include <cstdint>

#include "engine/volume/volume.h"

namespace palpate {

// A 64-bit hash of samples in order, size and type; the grid's position is left out. Equal
// volumes have equal hashes on every machine. Not cryptographic. Reads everything, on all
// cores.
uint64_t content_hash(const Volume& volume);

} // namespace palpate
