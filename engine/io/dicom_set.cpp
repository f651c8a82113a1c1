#include "engine/io/dicom_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "engine/base/assert.h"

namespace palpate::io {

namespace {

// Names this implementation; a UID of the same kind as new_uid() makes.
constexpr const char* kImplementation = "2.25.209512746353177023114826950717633046337";
constexpr const char* kExplicitLittleEndian = "1.2.840.10008.1.2.1";
constexpr const char* kImplicitLittleEndian = "1.2.840.10008.1.2";
constexpr size_t kMostDecimal = 16;

std::string little(uint64_t value, size_t bytes) {
    std::string out;
    for (size_t i = 0; i < bytes; ++i)
        out += static_cast<char>(value >> 8 * i & 0xff);
    return out;
}

std::string tag_bytes(uint32_t tag) {
    return little(tag >> 16, 2) + little(tag & 0xffff, 2);
}

} // namespace

std::string long_head(uint32_t tag, const char* representation, uint32_t bytes) {
    return tag_bytes(tag) + representation + std::string(2, '\0') + little(bytes, 4);
}

DicomSet& DicomSet::put(uint32_t tag, const char* representation, std::string value) {
    elements_[tag] = {representation, std::move(value), {}};
    return *this;
}

DicomSet& DicomSet::text(uint32_t tag, const char* representation, std::string_view value) {
    std::string padded(value);
    if (padded.size() % 2 != 0)
        padded += std::string_view(representation) == "UI" ? '\0' : ' ';
    return put(tag, representation, std::move(padded));
}

DicomSet& DicomSet::words(uint32_t tag, const std::vector<uint16_t>& values) {
    std::string bytes;
    for (const uint16_t value : values)
        bytes += little(value, 2);
    return put(tag, "US", bytes);
}

DicomSet& DicomSet::longs(uint32_t tag, const std::vector<uint32_t>& values) {
    std::string bytes;
    for (const uint32_t value : values)
        bytes += little(value, 4);
    return put(tag, "UL", bytes);
}

DicomSet& DicomSet::tag_value(uint32_t tag, uint32_t value) {
    return put(tag, "AT", tag_bytes(value));
}

DicomSet& DicomSet::bytes(uint32_t tag, std::string_view value) {
    std::string padded(value);
    if (padded.size() % 2 != 0)
        padded += '\0';
    return put(tag, "OB", std::move(padded));
}

DicomSet& DicomSet::decimals(uint32_t tag, const std::vector<double>& values) {
    std::string all;
    for (const double value : values)
        all += (all.empty() ? "" : "\\") + decimal_string(value);
    return text(tag, "DS", all);
}

DicomSet& DicomSet::sequence(uint32_t tag, const std::vector<DicomSet>& items) {
    elements_[tag] = {"SQ", {}, items};
    return *this;
}

std::string DicomSet::encoded(DicomEncoding encoding) const {
    std::string all;
    for (const auto& [tag, element] : elements_) {
        std::string value = element.value;
        for (const DicomSet& item : element.items) {
            const std::string body = item.encoded(encoding);
            value += tag_bytes(0xfffee000) + little(body.size(), 4) + body;
        }
        const bool is_long = element.representation == "OB" || element.representation == "SQ";
        if (encoding == DicomEncoding::implicit_little)
            all += tag_bytes(tag) + little(value.size(), 4);
        else if (is_long)
            all +=
                long_head(tag, element.representation.c_str(), static_cast<uint32_t>(value.size()));
        else {
            PALPATE_ASSERT_CMP(value.size(), <=, size_t{0xfffe}); // even, in 16 bits
            all += tag_bytes(tag) + element.representation + little(value.size(), 2);
        }
        all += value;
    }
    return all;
}

std::string decimal_string(double value) {
    std::string shortest = fmt::format("{}", value == 0.0 ? 0.0 : value); // no negative zero
    for (int digits = 15; shortest.size() > kMostDecimal && digits > 0; --digits)
        shortest = fmt::format("{:.{}g}", value, digits);
    return shortest;
}

std::string file_start(std::string_view class_uid, std::string_view instance_uid,
                       DicomEncoding encoding) {
    DicomSet meta;
    meta.bytes(0x00020001, std::string_view("\0\1", 2))
        .text(0x00020002, "UI", class_uid)
        .text(0x00020003, "UI", instance_uid)
        .text(0x00020010, "UI",
              encoding == DicomEncoding::explicit_little ? kExplicitLittleEndian
                                                         : kImplicitLittleEndian)
        .text(0x00020012, "UI", kImplementation)
        .text(0x00020013, "SH", "PALPATE");
    const std::string rest = meta.encoded();
    DicomSet length;
    length.longs(0x00020000, {static_cast<uint32_t>(rest.size())});
    return std::string(128, '\0') + "DICM" + length.encoded() + rest;
}

std::string new_uid() {
    std::random_device random;
    std::array<uint32_t, 4> words{}; // the most significant first
    for (uint32_t& word : words)
        word = random();
    words[1] = (words[1] & 0xffff0fffu) | 0x4000u; // a UUID of version 4 (RFC 4122)
    words[2] = (words[2] & 0x3fffffffu) | 0x80000000u;
    std::string digits;
    while (std::any_of(words.begin(), words.end(), [](uint32_t word) { return word != 0; })) {
        uint64_t rest = 0;
        for (uint32_t& word : words) { // divided by 10
            const uint64_t value = rest << 32 | word;
            word = static_cast<uint32_t>(value / 10);
            rest = value % 10;
        }
        digits += static_cast<char>('0' + rest);
    }
    std::reverse(digits.begin(), digits.end());
    return "2.25." + digits;
}

} // namespace palpate::io
