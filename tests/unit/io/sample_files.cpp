#include "tests/unit/io/sample_files.h"

#include <zlib.h>

namespace palpate::test {

namespace {

std::string big(uint32_t value) {
    return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
            static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string chunk(const std::string& kind, const std::string& data) {
    const std::string body = kind + data;
    const auto sum =
        ::crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return big(static_cast<uint32_t>(data.size())) + body + big(static_cast<uint32_t>(sum));
}

} // namespace

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
    return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + chunk("IDAT", packed) + chunk("IEND", "");
}

} // namespace palpate::test
