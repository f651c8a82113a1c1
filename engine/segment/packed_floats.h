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

// Numbers of 0 .. `largest` in 16 bits: 5 of an exponent, counted from that of the largest down,
// and 11 of a fraction. Rounded to the nearest, an error of at most 2^-12 of the number or 2^-31 of
// the largest; what was rounded once stays.
class PackedWeights {
 public:
    explicit PackedWeights(float largest) {
        const uint32_t exponent = std::bit_cast<uint32_t>(largest) >> 23;
        low_ = exponent > 31 ? (exponent - 31) << 23 : 0;
    }
    uint16_t pack(float v) const {
        const auto bits = std::bit_cast<uint32_t>(v);
        const uint32_t rounded = bits + 0x7ffu + (bits >> 12 & 1u);
        const uint32_t code = rounded < low_ ? 0 : (rounded - low_) >> 12;
        return uint16_t(code < 0xffff ? code : 0xffff);
    }
    float unpack(uint16_t code) const {
        return code == 0 ? 0.0f : std::bit_cast<float>((uint32_t{code} << 12) + low_);
    }

 private:
    uint32_t low_; // bits of the float below which all is 0
};

} // namespace palpate
