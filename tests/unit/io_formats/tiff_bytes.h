#pragma once

#include <string>
#include <vector>

#include "tests/unit/io_formats/generated_files.h"

// TIFF files of several pages, made byte by byte.
namespace palpate::io {

struct TiffBytes {
    bool big_endian = false;
    bool big_tiff = false;                                   // offsets of 8 bytes
    std::string description;                                 // of the first page
    uint32_t x_pixels = 0, x_of = 1, y_pixels = 0, y_of = 1; // resolution; 0: no such tags
    int unit = 0;                                            // tag 296; 0: none
    bool pages_have_tags = true; // else the pixels of all follow those of the first page

    // Pages of u16 numbers.
    std::string file(int width, int height, const std::vector<std::vector<int>>& pages) const {
        const size_t page_bytes = size_t(2) * size_t(width) * size_t(height);
        std::string pixels;
        for (const std::vector<int>& page : pages)
            for (const int n : page)
                pixels += number(n, 2);
        const size_t head = big_tiff ? 16 : 8;
        size_t at = head + pixels.size(); // of what follows the pixels
        std::string bytes = (big_endian ? "MM" : "II") +
                            (big_tiff ? number(43, 2) + number(8, 2) + number(0, 2) + number(at, 8)
                                      : number(42, 2) + number(at, 4)) +
                            pixels;
        const size_t count = pages_have_tags ? pages.size() : 1;
        for (size_t i = 0; i < count; ++i) {
            const bool first = i == 0;
            std::vector<std::string> tags{
                tag(256, 3, 1, number(width, 2)), tag(257, 3, 1, number(height, 2)),
                tag(258, 3, 1, number(16, 2)), tag(259, 3, 1, number(1, 2)),
                tag(262, 3, 1, number(1, 2))};
            std::string values; // of tags that they do not fit into
            const size_t entries = 9 + (first && !description.empty() ? 1 : 0) +
                                   (first && x_pixels > 0 ? 2 : 0) + (first && unit > 0 ? 1 : 0);
            const size_t values_at = at + (big_tiff ? 8 + 20 * entries + 8 : 2 + 12 * entries + 4);
            const auto far = [&](int id, int type, uint64_t n, const std::string& bytes_of_it) {
                if (bytes_of_it.size() <= word()) {
                    tags.push_back(tag(id, type, n, bytes_of_it));
                    return;
                }
                tags.push_back(tag(id, type, n, number(values_at + values.size(), int(word()))));
                values += bytes_of_it + std::string(bytes_of_it.size() % 2, '\0');
            };
            if (first && !description.empty())
                far(270, 2, description.size() + 1, description + std::string(1, '\0'));
            tags.push_back(tag(273, 4, 1, number(head + i * page_bytes, 4)));
            tags.push_back(tag(277, 3, 1, number(1, 2)));
            tags.push_back(tag(278, 3, 1, number(height, 2)));
            tags.push_back(tag(279, 4, 1, number(page_bytes, 4)));
            if (first && x_pixels > 0) {
                far(282, 5, 1, number(x_pixels, 4) + number(x_of, 4));
                far(283, 5, 1, number(y_pixels, 4) + number(y_of, 4));
            }
            if (first && unit > 0)
                tags.push_back(tag(296, 3, 1, number(unit, 2)));
            std::string directory = number(tags.size(), big_tiff ? 8 : 2);
            for (const std::string& one : tags)
                directory += one;
            const size_t end = values_at + values.size();
            directory += number(i + 1 < count ? end : 0, int(word()));
            bytes += directory + values;
            at = end;
        }
        return bytes;
    }

 private:
    size_t word() const { return big_tiff ? 8 : 4; }
    template <class T>
    std::string number(T value, int bytes) const {
        std::string text;
        for (int i = 0; i < bytes; ++i)
            text.push_back(static_cast<char>(static_cast<uint64_t>(value) >> 8 * i));
        return big_endian ? std::string(text.rbegin(), text.rend()) : text;
    }
    std::string tag(int id, int type, uint64_t count, const std::string& value) const {
        return number(id, 2) + number(type, 2) + number(count, int(word())) + value +
               std::string(word() - value.size(), '\0');
    }
};

// The pages of sizes x, y, z and c, t, in an order such as "zct", fastest first; page p of them
// holds number_at(x, y, z, c + channels * t).
inline std::vector<std::vector<int>> pages_of(const Sizes& sizes, int channels, int times,
                                              const std::string& order) {
    std::vector<std::vector<int>> pages;
    for (int p = 0; p < sizes.z * channels * times; ++p) {
        int rest = p, z = 0, c = 0, t = 0;
        for (const char axis : order) {
            const int size = axis == 'z' ? sizes.z : axis == 'c' ? channels : times;
            (axis == 'z' ? z : axis == 'c' ? c : t) = rest % size;
            rest /= size;
        }
        std::vector<int> page;
        for (int y = 0; y < sizes.y; ++y)
            for (int x = 0; x < sizes.x; ++x)
                page.push_back(number_at(x, y, z, c + channels * t));
        pages.push_back(page);
    }
    return pages;
}

} // namespace palpate::io
