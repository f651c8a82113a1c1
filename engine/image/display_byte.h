#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace palpate {

// The 8 bits that a screen or a PNG holds of a display value (image.h): round(255 * clamp(v, 0,
// 1)), halves upwards; NaN is 0.
inline uint8_t display_byte(float value) {
    return value > 0.0f ? static_cast<uint8_t>(std::lround(255.0f * std::min(value, 1.0f))) : 0;
}

} // namespace palpate
