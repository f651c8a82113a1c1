#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace palpate {

// How a sample is stored. Every value of every type is exact in float.
enum class ScalarType : uint8_t { u8, i8, u16, i16, f32 };

constexpr size_t bytes_per_sample(ScalarType type) {
    switch (type) {
        case ScalarType::u8:
        case ScalarType::i8:
            return 1;
        case ScalarType::u16:
        case ScalarType::i16:
            return 2;
        case ScalarType::f32:
            return 4;
    }
    return 0;
}

// "u8", "i8", "u16", "i16" or "f32".
constexpr const char* name_of(ScalarType type) {
    constexpr const char* names[] = {"u8", "i8", "u16", "i16", "f32"};
    return names[static_cast<size_t>(type)];
}

template <class T>
constexpr ScalarType scalar_type_of = ScalarType::f32;
template <>
inline constexpr ScalarType scalar_type_of<uint8_t> = ScalarType::u8;
template <>
inline constexpr ScalarType scalar_type_of<int8_t> = ScalarType::i8;
template <>
inline constexpr ScalarType scalar_type_of<uint16_t> = ScalarType::u16;
template <>
inline constexpr ScalarType scalar_type_of<int16_t> = ScalarType::i16;

// Calls visitor(T{}) with the C++ type that stores `type`, and returns what it returns.
template <class Visitor>
decltype(auto) visit_scalar(ScalarType type, Visitor&& visitor) {
    switch (type) {
        case ScalarType::u8:
            return visitor(uint8_t{});
        case ScalarType::i8:
            return visitor(int8_t{});
        case ScalarType::u16:
            return visitor(uint16_t{});
        case ScalarType::i16:
            return visitor(int16_t{});
        case ScalarType::f32:
            break;
    }
    return visitor(float{});
}

// The lowest and highest value of some samples, no-data left out. Empty when min > max.
struct ValueRange {
    float min = std::numeric_limits<float>::infinity();
    float max = -std::numeric_limits<float>::infinity();

    bool empty() const { return min > max; }
    void include(float value) {
        min = std::min(min, value);
        max = std::max(max, value);
    }
    void include(ValueRange other) {
        min = std::min(min, other.min);
        max = std::max(max, other.max);
    }
    friend bool operator==(const ValueRange&, const ValueRange&) = default;
};

} // namespace palpate
