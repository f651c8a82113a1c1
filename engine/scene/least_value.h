#pragma once

#include "engine/scene/transfer_function.h"

namespace palpate {

// Mode mip shows the largest value along a ray or, where the function's opacity falls from its
// first point to its last, the smallest: a minimum intensity projection.
inline bool shows_least_value(const TransferFunction& function) {
    return !function.opacities.empty() &&
           function.opacities.front().opacity > function.opacities.back().opacity;
}

} // namespace palpate
