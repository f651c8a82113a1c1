#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/edit/edit_mask.h"
#include "engine/volume/volume.h"

namespace palpate {

// What an edit that knows nothing of it leaves as it was.
struct EditLimits {
    std::vector<uint16_t> spared{}; // rising, from 1 on
    EditMask mask{};
    std::optional<Volume> values{}; // grey, on the labels' grid; where mask.values is given

    bool are_none() const { return spared.empty() && mask.is_open(); }
};

// A label map as an edit that knows of no limits may leave it.
struct Spared {
    Volume labels;
    uint16_t met = 0;      // the lowest spared label of which a sample would have changed; 0: none
    bool met_mask = false; // a sample would have changed that the mask closes
};

// The map `after`, but for the samples that had a label of `spared` in `before` or get one, and for
// those that the mask closes: they are as in `before`. `after` itself where there are none. Both
// are u8 or u16, on one grid; the cost follows their difference. Values on another grid close all.
Spared sparing(const Volume& before, const Volume& after, const EditLimits& limits);

} // namespace palpate
