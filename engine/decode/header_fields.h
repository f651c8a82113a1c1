#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <glm/glm.hpp>
#include <span>
#include <string_view>

namespace palpate::io {

// Up to four bytes as one number.
inline uint32_t number_of(std::string_view bytes, bool big_endian) {
    uint32_t value = 0;
    for (size_t i = 0; i < bytes.size(); ++i)
        value =
            value << 8 | static_cast<unsigned char>(bytes[big_endian ? i : bytes.size() - 1 - i]);
    return value;
}

// Numbers at byte offsets of a binary header of either byte order. Offsets must lie within the
// header: nothing is checked here.
class HeaderFields {
 public:
    HeaderFields(std::span<const std::byte> bytes, bool big_endian)
        : bytes_(bytes), big_endian_(big_endian) {}

    template <class T>
    T at(size_t offset) const {
        std::array<std::byte, sizeof(T)> raw;
        std::memcpy(raw.data(), bytes_.data() + offset, sizeof(T));
        if (big_endian_)
            std::reverse(raw.begin(), raw.end());
        T value;
        std::memcpy(&value, raw.data(), sizeof(T));
        return value;
    }
    template <class T, class To, size_t N>
    void copy(size_t offset, std::array<To, N>& out) const {
        for (size_t i = 0; i < N; ++i)
            out[i] = at<T>(offset + i * sizeof(T));
    }
    template <class T>
    glm::dvec3 vector(size_t offset) const {
        return {at<T>(offset), at<T>(offset + sizeof(T)), at<T>(offset + 2 * sizeof(T))};
    }
    template <class T>
    glm::dmat4 rows(size_t offset) const { // three rows of four
        glm::dmat4 matrix(1);
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                matrix[column][row] = at<T>(offset + sizeof(T) * (4 * row + column));
        return matrix;
    }
    std::string_view text(size_t offset, size_t count) const {
        return {reinterpret_cast<const char*>(bytes_.data()) + offset, count};
    }

 private:
    std::span<const std::byte> bytes_;
    bool big_endian_;
};

} // namespace palpate::io
