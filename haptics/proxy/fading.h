#pragma once

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// The samples that an algorithm reads at its places.
enum class Reads : uint8_t {
    nothing, // it says itself where data are missing: Contact::unknown
    source,  // of parameters.source
    grey,
    grey_and_field, // and the scene's vector field
};

// An algorithm whose paper says nothing of missing data, made to keep
// Algorithm's rule for them.
//
// Where samples about the tool, the proxy or the contact point have no data or
// are not in memory, the contact is `unknown`, the force of the tick before
// fades by Yielding::kRate_n_per_s, and the algorithm is reset to the tool.
// Where there are data again, its force comes by that rate, too, for 0.1 s:
// beyond what the spring makes of the hand's motion. Elsewhere nothing is
// changed.
std::unique_ptr<Algorithm> with_fading(std::unique_ptr<Algorithm> algorithm, Reads reads);

} // namespace palpate::haptics
