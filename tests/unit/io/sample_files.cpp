#include "tests/unit/io/sample_files.h"

#include <zlib.h>

#include <cstdlib>

namespace palpate::test {

namespace {

std::string big(uint32_t value) {
    return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
            static_cast<char>(value >> 8), static_cast<char>(value)};
}

} // namespace

std::string png_chunk(const std::string& kind, const std::string& data) {
    const std::string body = kind + data;
    const auto sum =
        ::crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return big(static_cast<uint32_t>(data.size())) + body + big(static_cast<uint32_t>(sum));
}

std::string png(const std::vector<std::vector<uint16_t>>& rows) {
    std::string raw;
    for (const auto& row : rows) {
        raw.push_back('\0'); // no filter
        for (const uint16_t value : row) {
            raw.push_back(static_cast<char>(value >> 8));
            raw.push_back(static_cast<char>(value));
        }
    }
    std::string packed(::compressBound(raw.size()), '\0');
    uLongf length = packed.size();
    ::compress(reinterpret_cast<Bytef*>(packed.data()), &length,
               reinterpret_cast<const Bytef*>(raw.data()), raw.size());
    packed.resize(length);
    const std::string header = big(static_cast<uint32_t>(rows[0].size())) +
                               big(static_cast<uint32_t>(rows.size())) +
                               std::string("\x10\0\0\0\0", 5); // 16 bits, grey
    return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) + png_chunk("IDAT", packed) +
           png_chunk("IEND", "");
}

std::string bmp(const std::vector<std::vector<uint8_t>>& rows, bool runs) {
    std::string palette, pixels;
    for (int i = 0; i < 256; ++i)
        palette += std::string(3, static_cast<char>(i)) + '\0';
    for (size_t y = rows.size(); y-- > 0;) { // from the bottom up
        std::string row;
        for (const uint8_t value : rows[y]) {
            if (runs)
                row.push_back(1);
            row.push_back(static_cast<char>(value));
        }
        row.resize(runs ? row.size() + 2 : (row.size() + 3) / 4 * 4); // 0 0 ends the line
        pixels += row;
    }
    if (runs)
        pixels += std::string("\0\1", 2);
    const size_t begin = 54 + palette.size();
    return "BM" + little(begin + pixels.size(), 4) + little(0, 4) + little(begin, 4) +
           little(40, 4) + little(rows[0].size(), 4) + little(rows.size(), 4) + little(1, 2) +
           little(8, 2) + little(runs, 4) + little(pixels.size(), 4) + little(2835, 4) +
           little(2835, 4) + little(256, 4) + little(0, 4) + palette + pixels;
}

std::string tiff(const std::vector<std::vector<uint16_t>>& rows, bool big_endian) {
    const auto number = [&](uint64_t value, int bytes) {
        std::string text = little(value, bytes);
        return big_endian ? std::string(text.rbegin(), text.rend()) : text;
    };
    const size_t row_bytes = 2 * rows[0].size(), a_strip = (rows.size() + 1) / 2,
                 first = a_strip * row_bytes, all = rows.size() * row_bytes;
    std::string pixels;
    for (const auto& row : rows)
        for (const uint16_t value : row)
            pixels += number(value, 2);
    const bool two = all > first; // places and sizes of two strips do not fit into a tag
    const std::string lists =
        two ? number(8, 4) + number(8 + first, 4) + number(first, 4) + number(all - first, 4) : "";
    const auto tag = [&](int id, int type, uint64_t count, uint64_t value) {
        const std::string text = number(value, type == 3 ? 2 : 4); // at the left of four bytes
        return number(static_cast<uint64_t>(id), 2) + number(static_cast<uint64_t>(type), 2) +
               number(count, 4) + text + std::string(4 - text.size(), '\0');
    };
    const size_t lists_at = 8 + all, directory_at = lists_at + lists.size();
    return (big_endian ? "MM" : "II") + number(42, 2) + number(directory_at, 4) + pixels + lists +
           number(9, 2) + tag(256, 3, 1, rows[0].size()) + tag(257, 3, 1, rows.size()) +
           tag(258, 3, 1, 16) + tag(259, 3, 1, 1) + tag(262, 3, 1, 1) +
           tag(273, 4, two ? 2 : 1, two ? lists_at : 8) + tag(277, 3, 1, 1) +
           tag(278, 3, 1, a_strip) + tag(279, 4, two ? 2 : 1, two ? lists_at + 8 : all) +
           number(0, 4);
}

// ITU-T T.81 with tables of our own: a step of 8 for all coefficients, so that the first one is the
// block's value less 128; codes of four bits for its nine categories; one bit for "no others".
std::string jpeg(const std::vector<std::vector<int>>& blocks, int restart) {
    const auto segment = [](char marker, const std::string& data) {
        return std::string{'\xff', marker} + big(static_cast<uint32_t>(data.size() + 2)).substr(2) +
               data;
    };
    std::string categories;
    for (char c = 0; c < 9; ++c)
        categories.push_back(c);
    const size_t rows = 8 * blocks.size(), columns = 8 * blocks[0].size();
    std::string bytes =
        "\xff\xd8" + segment('\xdb', std::string(1, '\0') + std::string(64, 8)) +
        segment('\xc0', "\x08" + big(static_cast<uint32_t>(rows)).substr(2) +
                            big(static_cast<uint32_t>(columns)).substr(2) +
                            std::string("\x01\x01\x11\0", 4)) +
        segment('\xc4', std::string("\0\0\0\0\x09", 5) + std::string(12, '\0') + categories) +
        segment('\xc4', std::string("\x10\x01", 2) + std::string(16, '\0'));
    if (restart > 0)
        bytes += segment('\xdd', big(static_cast<uint32_t>(restart)).substr(2));
    bytes += segment('\xda', std::string("\x01\x01\0\0\x3f\0", 6));
    uint32_t word = 0;
    int bits = 0;
    const auto put = [&](uint32_t value, int count) {
        for (int i = count - 1; i >= 0; --i) {
            word = word << 1 | (value >> i & 1);
            if (++bits < 8)
                continue;
            bytes.push_back(static_cast<char>(word));
            if ((word & 0xff) == 0xff)
                bytes.push_back('\0');
            bits = 0;
        }
    };
    const auto pad = [&] {
        while (bits > 0)
            put(1, 1);
    };
    int before = 0, done = 0;
    for (const std::vector<int>& row : blocks)
        for (const int value : row) {
            if (restart > 0 && done > 0 && done % restart == 0) {
                pad();
                bytes += {'\xff', static_cast<char>(0xd0 + (done / restart - 1) % 8)};
                before = 0;
            }
            const int step = value - 128 - before;
            before = value - 128;
            int category = 0;
            while (std::abs(step) >> category)
                ++category;
            put(static_cast<uint32_t>(category), 4);
            put(static_cast<uint32_t>(step > 0 ? step : step + (1 << category) - 1), category);
            put(0, 1);
            ++done;
        }
    pad();
    return bytes + "\xff\xd9";
}

} // namespace palpate::test
