#pragma once

#include <cstdint>
#include <span>

#include "engine/volume/volume.h"

namespace palpate {

// A label map in which an edit that knows nothing of locked labels leaves them as they were.
struct Spared {
    Volume labels;
    uint16_t met = 0; // the lowest spared label of which a sample would have changed; 0: none
};

// The map `after`, but for the samples that had a label of `spared` in `before` or get one: they
// are as in `before`. `after` itself where there are none. Both are u8 or u16, on one grid; the
// cost follows their difference.
Spared sparing(const Volume& before, const Volume& after, std::span<const uint16_t> spared);

} // namespace palpate
