#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace palpate {

// The upper half of a float: its sign, its exponent and 7 bits of its fraction (bfloat16). Fields
// that need no more are kept so, in volumes of u16.

// Rounded to the nearest, an error of at most 2^-8 of |v| (normal numbers); NaN stays NaN.
inline uint16_t packed_float(float v) {
    const auto bits = std::bit_cast<uint32_t>(v);
    if (std::isnan(v))
        return 0x7fc0;
    return uint16_t((bits + 0x7fffu + (bits >> 16 & 1u)) >> 16);
}

inline float unpacked_float(uint16_t v) {
    return std::bit_cast<float>(uint32_t{v} << 16);
}

} // namespace palpate
