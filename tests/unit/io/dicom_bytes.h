#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/io/sample_files.h"

// DICOM files written byte by byte (PS3.5 7 and PS3.10 7), so that tests know what they hold.
namespace palpate::test {

constexpr const char* kImplicitLittle = "1.2.840.10008.1.2";
constexpr const char* kExplicitLittle = "1.2.840.10008.1.2.1";
constexpr const char* kRle = "1.2.840.10008.1.2.5";
constexpr const char* kJpegLsLossless = "1.2.840.10008.1.2.4.80";
constexpr const char* kJpeg2000Lossless = "1.2.840.10008.1.2.4.90";

// How a data set is written: with or without representations, and sequences and items with their
// lengths or up to delimiters (PS3.5 7.5).
struct Encoding {
    bool implicit = false;
    bool delimited = false;
    bool unknown = false;  // explicit, but sequences are UN and implicit within (PS3.5 6.2.2)
    bool deflated = false; // explicit; by those who write through deflated_file()
};

// The encoding of files for which a test names none.
inline Encoding default_encoding;

// Tests that run in each of the four encodings.
class InEveryEncoding : public testing::TestWithParam<Encoding> {
 protected:
    InEveryEncoding() { default_encoding = GetParam(); }
    ~InEveryEncoding() override { default_encoding = {}; }
};
inline auto every_encoding() {
    return testing::Values(Encoding{false, false}, Encoding{false, true}, Encoding{true, false},
                           Encoding{true, true});
}
inline std::string encoding_name(const testing::TestParamInfo<Encoding>& info) {
    return std::string(info.param.deflated   ? "Deflated"
                       : info.param.implicit ? "Implicit"
                                             : "Explicit") +
           (info.param.delimited ? "Delimited" : "Stated");
}

// A data set. Putting an element again replaces it.
class DicomData {
 public:
    DicomData& put(uint16_t group, uint16_t number, const std::string& vr, std::string value) {
        if (value.size() % 2)
            value.push_back(vr == "UI" || vr == "OB" ? '\0' : ' ');
        elements_[{group, number}] = {vr, std::move(value), {}, {}};
        return *this;
    }
    DicomData& put_words(uint16_t group, uint16_t number, const std::vector<uint16_t>& values,
                         const char* vr = "US") {
        std::string bytes;
        for (const uint16_t value : values)
            bytes += little(value, 2);
        return put(group, number, vr, bytes);
    }
    DicomData& put_longs(uint16_t group, uint16_t number, const std::vector<uint32_t>& values) {
        std::string bytes;
        for (const uint32_t value : values)
            bytes += little(value, 4);
        return put(group, number, "UL", bytes);
    }
    DicomData& put_doubles(uint16_t group, uint16_t number, const std::vector<double>& values) {
        std::string bytes;
        for (const double value : values)
            bytes += little(std::bit_cast<uint64_t>(value), 8);
        return put(group, number, "FD", bytes);
    }
    DicomData& put_items(uint16_t group, uint16_t number, const std::vector<DicomData>& items) {
        elements_[{group, number}] = {"SQ", {}, items, {}};
        return *this;
    }
    // Encapsulated pixel data: an empty table of offsets, then an item for each fragment.
    DicomData& put_fragments(const std::vector<std::string>& fragments) {
        elements_[{0x7fe0, 0x10}] = {"OB", {}, {}, fragments};
        return *this;
    }
    DicomData& erase(uint16_t group, uint16_t number) {
        elements_.erase({group, number});
        return *this;
    }
    std::string bytes(Encoding encoding) const {
        std::string all;
        for (const auto& [tag, element] : elements_)
            all += element_bytes(tag, element, encoding);
        return all;
    }
    // A whole file, with the preamble. Where no syntax is stated, the encoding tells it; where one
    // is, it tells whether representations are written.
    std::string file(const std::string& class_uid, const std::string& instance_uid,
                     std::string syntax = {}, Encoding encoding = default_encoding) const {
        if (syntax.empty())
            syntax = encoding.implicit ? kImplicitLittle : kExplicitLittle;
        encoding.implicit = syntax == kImplicitLittle;
        DicomData meta;
        meta.put(2, 2, "UI", class_uid).put(2, 3, "UI", instance_uid).put(2, 0x10, "UI", syntax);
        DicomData data = *this;
        data.put(8, 0x16, "UI", class_uid).put(8, 0x18, "UI", instance_uid);
        meta.put(2, 0, "UL", little(meta.bytes({}).size(), 4));
        return std::string(128, '\0') + "DICM" + meta.bytes({}) + data.bytes(encoding);
    }

 private:
    using Tag = std::pair<uint16_t, uint16_t>;
    struct Element {
        std::string vr, value;
        std::vector<DicomData> items;       // of SQ
        std::vector<std::string> fragments; // of encapsulated pixels
    };

    static std::string head(Tag tag, const std::string& vr, size_t length, Encoding encoding) {
        const std::string start = little(tag.first, 2) + little(tag.second, 2);
        if (encoding.implicit)
            return start + little(length, 4);
        const bool is_long = vr == "OB" || vr == "OD" || vr == "OF" || vr == "OW" || vr == "SQ" ||
                             vr == "UN" || vr == "UT";
        return start + vr +
               (is_long ? std::string(2, '\0') + little(length, 4) : little(length, 2));
    }
    static std::string item(const std::string& body, bool delimited) {
        const std::string start = little(0xe000fffe, 4);
        return delimited
                   ? start + little(kUndefined, 4) + body + little(0xe00dfffe, 4) + little(0, 4)
                   : start + little(body.size(), 4) + body;
    }
    static std::string element_bytes(Tag tag, const Element& element, Encoding encoding) {
        std::string body = element.value;
        const bool unknown = encoding.unknown && !encoding.implicit && element.vr == "SQ";
        const std::string vr = unknown ? "UN" : element.vr;
        const Encoding within{encoding.implicit || unknown, encoding.delimited};
        for (const DicomData& one : element.items)
            body += item(one.bytes(within), encoding.delimited);
        if (!element.fragments.empty())
            body += item("", false);
        for (std::string fragment : element.fragments) {
            if (fragment.size() % 2)
                fragment.push_back('\0');
            body += item(fragment, false);
        }
        const bool delimited =
            !element.fragments.empty() || (element.vr == "SQ" && encoding.delimited);
        return head(tag, vr, delimited ? kUndefined : body.size(), encoding) + body +
               (delimited ? little(0xe0ddfffe, 4) + little(0, 4) : "");
    }

    static constexpr uint32_t kUndefined = 0xffffffff;
    std::map<Tag, Element> elements_;
};

constexpr const char* kCtClass = "1.2.840.10008.5.1.4.1.1.2";
constexpr const char* kMrClass = "1.2.840.10008.5.1.4.1.1.4";
constexpr const char* kSegClass = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* kLabelMapClass = "1.2.840.10008.5.1.4.1.1.66.7";
constexpr const char* kStructureClass = "1.2.840.10008.5.1.4.1.1.481.3";

// Rows, columns, bits and the representation of samples.
inline DicomData samples(uint16_t columns, uint16_t rows, uint16_t allocated, uint16_t stored,
                         bool is_signed) {
    DicomData data;
    data.put_words(0x28, 2, {1}).put(0x28, 4, "CS", "MONOCHROME2");
    data.put_words(0x28, 0x10, {rows}).put_words(0x28, 0x11, {columns});
    data.put_words(0x28, 0x100, {allocated}).put_words(0x28, 0x101, {stored});
    data.put_words(0x28, 0x102, {static_cast<uint16_t>(stored - 1)});
    data.put_words(0x28, 0x103, {static_cast<uint16_t>(is_signed ? 1 : 0)});
    return data;
}

// States the place of an image, as classic images do.
inline void place(DicomData& data, const std::string& position, const std::string& axes,
                  const std::string& spacing) {
    data.put(0x20, 0x32, "DS", position).put(0x20, 0x37, "DS", axes);
    data.put(0x28, 0x30, "DS", spacing);
}

inline std::string words_16(const std::vector<int>& values) {
    std::string bytes;
    for (const int value : values)
        bytes += little(static_cast<uint16_t>(value), 2);
    return bytes;
}

// One axial CT slice of 0.5 x 0.75 mm, value = x + 10 y + 100 z - 1000 HU.
inline std::string dicom_slice(int z, double step_mm = 2.5, uint16_t columns = 8,
                               uint16_t rows = 4) {
    DicomData data = samples(columns, rows, 16, 16, true);
    data.put(8, 0x60, "CS", "CT").put(8, 0x103e, "LO", "head");
    data.put(0x20, 0x0d, "UI", "1.2.3").put(0x20, 0x0e, "UI", "1.2.3.4");
    data.put(0x20, 0x13, "IS", std::to_string(z + 1));
    place(data, "-10\\20\\" + std::to_string(step_mm * z), "1\\0\\0\\0\\1\\0", "0.75\\0.5");
    data.put(0x28, 0x1052, "DS", "-1000").put(0x28, 0x1053, "DS", "1");
    std::vector<int> values;
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
            values.push_back(x + 10 * y + 100 * z);
    data.put(0x7fe0, 0x10, "OW", words_16(values));
    return data.file(kCtClass, "1.2.3.4." + std::to_string(z + 1));
}

} // namespace palpate::test
