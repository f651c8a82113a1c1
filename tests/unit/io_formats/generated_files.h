#pragma once

#include <array>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/io_formats/sample_files.h"

// Arrays of four axes in any order, type and byte order, whose numbers are known by arithmetic.
namespace palpate::io {

// Sizes of x, y, z and of the frames t.
struct Sizes {
    int x = 1, y = 1, z = 1, t = 1;

    int of(char axis) const { return axis == 'x' ? x : axis == 'y' ? y : axis == 'z' ? z : t; }
};

// The number at a place: 0 .. 120, which every type holds.
inline int number_at(int x, int y, int z, int t) {
    return (7 * x + 13 * y + 29 * z + 31 * t) % 121;
}

// The numbers of one frame, x fastest.
inline std::vector<double> frame_of(const Sizes& sizes, int t) {
    std::vector<double> values;
    for (int z = 0; z < sizes.z; ++z)
        for (int y = 0; y < sizes.y; ++y)
            for (int x = 0; x < sizes.x; ++x)
                values.push_back(number_at(x, y, z, t));
    return values;
}

// All numbers as a file holds them whose axes are, fastest first, the letters of `order` ("txyz").
inline std::vector<int> numbers_of(const Sizes& sizes, const std::string& order) {
    std::vector<int> numbers;
    size_t all = 1;
    for (const char axis : order)
        all *= static_cast<size_t>(sizes.of(axis));
    for (size_t i = 0; i < all; ++i) {
        size_t rest = i;
        int x = 0, y = 0, z = 0, t = 0;
        for (const char axis : order) {
            const auto size = static_cast<size_t>(sizes.of(axis));
            (axis == 'x'   ? x
             : axis == 'y' ? y
             : axis == 'z' ? z
                           : t) = static_cast<int>(rest % size);
            rest /= size;
        }
        numbers.push_back(number_at(x, y, z, t));
    }
    return numbers;
}

struct NumberType {
    const char *nrrd, *meta;
    std::function<std::string(int, bool)> bytes; // of a number, big endian or not
};

template <class T>
NumberType number_type(const char* nrrd, const char* meta) {
    return {nrrd, meta, [](int n, bool big) { return bytes_of(static_cast<T>(n), big); }};
}

inline std::vector<NumberType> number_types() {
    return {
        number_type<uint8_t>("uchar", "MET_UCHAR"),    number_type<int8_t>("int8", "MET_CHAR"),
        number_type<uint16_t>("ushort", "MET_USHORT"), number_type<int16_t>("short", "MET_SHORT"),
        number_type<int32_t>("int", "MET_INT"),        number_type<float>("float", "MET_FLOAT"),
        number_type<double>("double", "MET_DOUBLE")};
}

enum class Written { raw, packed, text };

// Numbers first .. first + count - 1 as bytes of a file.
inline std::string written(const std::vector<int>& numbers, size_t first, size_t count,
                           const NumberType& type, bool big_endian, Written as,
                           int window_bits = 31) {
    std::string bytes;
    for (size_t i = first; i < first + count; ++i)
        bytes += as == Written::text ? std::to_string(numbers[i]) + (i % 5 == 4 ? "\n" : " ")
                                     : type.bytes(numbers[i], big_endian);
    return as == Written::packed ? deflated(bytes, window_bits) : bytes;
}

// 0 .. end - 1, the same on every machine.
inline int below(std::mt19937& random, int end) {
    return static_cast<int>(random() % static_cast<unsigned>(end));
}

// A NRRD header whose axes are those of `order`; its spacing is 1, 2 and 3.
inline std::string nrrd_header_of(const Sizes& sizes, const std::string& order,
                                  const NumberType& type, bool big_endian, Written as,
                                  const std::string& list_kind, const std::string& more = "") {
    constexpr const char* encodings[] = {"raw", "gzip", "ascii"};
    std::string size_words, kinds, directions;
    for (const char axis : order) {
        size_words += " " + std::to_string(sizes.of(axis));
        kinds += axis == 't' ? " " + list_kind : " domain";
        directions += axis == 'x'   ? " (1,0,0)"
                      : axis == 'y' ? " (0,2,0)"
                      : axis == 'z' ? " (0,0,3)"
                                    : " none";
    }
    return "NRRD0005\ntype: " + std::string(type.nrrd) +
           "\ndimension: " + std::to_string(order.size()) + "\nsizes:" + size_words +
           "\nspace: LPS\nkinds:" + kinds + "\nspace directions:" + directions +
           "\nendian: " + (big_endian ? "big" : "little") +
           "\nencoding: " + encodings[static_cast<int>(as)] + "\n" + more;
}

} // namespace palpate::io
