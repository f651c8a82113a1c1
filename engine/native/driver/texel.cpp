#include "engine/native/driver/texel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace palpate::native::driver {

namespace {

// The nearest half-precision number, ties to even.
uint16_t half_of(float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    const auto sign = static_cast<uint16_t>(bits >> 16 & 0x8000u);
    const uint32_t magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return sign | 0x7e00u; // NaN
    if (magnitude >= 0x477ff000u)
        return sign | 0x7c00u;   // beyond the largest, 65504, by half a step
    if (magnitude < 0x38800000u) // below the smallest normal number: counts of 2^-24
        return sign | static_cast<uint16_t>(std::lrint(std::ldexp(std::fabs(value), 24)));
    const uint32_t rounded = magnitude + 0xfffu + (magnitude >> 13 & 1u);
    return sign | static_cast<uint16_t>((rounded - 0x38000000u) >> 13);
}

template <class T>
T scaled(float value, float low) {
    const double clamped = std::isnan(value) ? 0.0 : std::clamp(value, low, 1.0f);
    return static_cast<T>(std::lrint(clamped * std::numeric_limits<T>::max()));
}

template <class T, size_t n>
std::array<std::byte, 16> pack(const std::array<T, n>& channels) {
    static_assert(sizeof channels <= 16);
    std::array<std::byte, 16> texel{};
    std::memcpy(texel.data(), channels.data(), sizeof channels);
    return texel;
}

} // namespace

std::array<std::byte, 16> texel_of(VkFormat format, const VkClearColorValue& color) {
    const auto& f = color.float32;
    const auto& u = color.uint32;
    const auto u8 = [&](size_t i) { return scaled<uint8_t>(f[i], 0.0f); };
    const auto u16 = [&](size_t i) { return scaled<uint16_t>(f[i], 0.0f); };
    switch (format) {
        case VK_FORMAT_R8_UNORM:
            return pack(std::array{u8(0)});
        case VK_FORMAT_R8_UINT:
            return pack(std::array{static_cast<uint8_t>(u[0])});
        case VK_FORMAT_R8G8_UNORM:
            return pack(std::array{u8(0), u8(1)});
        case VK_FORMAT_R16_UNORM:
            return pack(std::array{u16(0)});
        case VK_FORMAT_R16_SNORM:
            return pack(std::array{scaled<int16_t>(f[0], -1.0f)});
        case VK_FORMAT_R16_UINT:
            return pack(std::array{static_cast<uint16_t>(u[0])});
        case VK_FORMAT_R16_SFLOAT:
            return pack(std::array{half_of(f[0])});
        case VK_FORMAT_R8G8B8A8_UNORM:
            return pack(std::array{u8(0), u8(1), u8(2), u8(3)});
        case VK_FORMAT_B8G8R8A8_UNORM:
            return pack(std::array{u8(2), u8(1), u8(0), u8(3)});
        case VK_FORMAT_R16G16_UNORM:
            return pack(std::array{u16(0), u16(1)});
        case VK_FORMAT_R16G16_SFLOAT:
            return pack(std::array{half_of(f[0]), half_of(f[1])});
        case VK_FORMAT_R16G16B16A16_SFLOAT:
            return pack(std::array{half_of(f[0]), half_of(f[1]), half_of(f[2]), half_of(f[3])});
        default: // channels of 32 bits, whose first are the texel
            return pack(std::array{u[0], u[1], u[2], u[3]});
    }
}

} // namespace palpate::native::driver
