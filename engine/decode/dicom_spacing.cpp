#include "engine/decode/dicom_spacing.h"

#include <algorithm>
#include <cmath>

#include "engine/decode/dicom_elements.h"

namespace palpate::io {

namespace {

using gdcm::DataSet;
using gdcm::Tag;

constexpr uint16_t kCentimetres = 3; // PS3.3 C.8.5.5.1.15
constexpr double kSameSpacing = 1e-3;

void take_ultrasound_spacing(const DataSet& set, DicomFrame& frame) {
    const DicomItems regions(set, Tag(0x0018, 0x6011));
    std::optional<glm::dvec2> spacing;
    size_t others = 0;
    for (size_t i = 0; const DicomItem region = regions.at(i); ++i) {
        const double x = number<double>(*region, Tag(0x0018, 0x602c)).value_or(0);
        const double y = number<double>(*region, Tag(0x0018, 0x602e)).value_or(0);
        const glm::dvec2 mm = 10.0 * glm::abs(glm::dvec2(x, y)); // negative: from the right
        if (word<0x0018, 0x6024>(*region) != kCentimetres ||
            word<0x0018, 0x6026>(*region) != kCentimetres || !std::isfinite(mm.x + mm.y) ||
            mm.x <= 0 || mm.y <= 0) {
            ++others;
            continue;
        }
        const glm::dvec2 first = spacing.value_or(mm);
        if (glm::distance(first, mm) > kSameSpacing * glm::length(first)) {
            frame.spacing_words = fmt::format(
                "its ultrasound regions have several pixel spacings, {:.4g} x {:.4g} and {:.4g} x "
                "{:.4g} mm among them; none is taken",
                first.x, first.y, mm.x, mm.y);
            return;
        }
        spacing = first;
    }
    frame.spacing_mm = spacing;
    if (others == 0)
        return;
    frame.spacing_words =
        spacing ? fmt::format(
                      "the pixel spacing is that of its ultrasound regions in centimetres; "
                      "{} more of its regions, such as spectra, state no lengths",
                      others)
                : "its ultrasound regions state no lengths in centimetres";
}

// The numbers of US or SS, and of UL or SL.
std::optional<double> whole_number(const DataSet& set, Tag tag, const DicomFile& file) {
    std::optional<int64_t> value;
    if (file.bits_allocated == 32)
        if (const auto wide = number<uint32_t>(set, tag))
            value = *wide;
    uint32_t bits = 32;
    if (!value) {
        bits = 16;
        if (const auto narrow = number<uint16_t>(set, tag))
            value = *narrow;
    }
    if (!value)
        return {};
    const bool is_signed = file.type == ComponentType::i8 || file.type == ComponentType::i16 ||
                           file.type == ComponentType::i32;
    if (is_signed && *value >= int64_t{1} << (bits - 1))
        *value -= int64_t{1} << bits;
    // Some write the stored bits alone of a negative number.
    if (is_signed && file.bits_stored > 1 && file.bits_stored < bits &&
        *value >= int64_t{1} << (file.bits_stored - 1) && *value < int64_t{1} << file.bits_stored)
        *value -= int64_t{1} << file.bits_stored;
    return static_cast<double>(*value);
}

} // namespace

void take_other_spacing(const DataSet& set, DicomFrame& frame) {
    if (frame.spacing_mm)
        return;
    struct Other {
        Tag tag;
        const char* words;
    };
    const Other others[] = {
        {Tag(0x0018, 0x1164),
         "the pixel spacing is that at the detector (Imager Pixel Spacing); lengths in the "
         "patient are shorter by the magnification"},
        {Tag(0x0018, 0x2010),
         "the pixel spacing is that of the film (Nominal Scanned Pixel Spacing); lengths in the "
         "patient are shorter by the magnification"},
    };
    for (const Other& other : others) {
        const std::vector<double> stated = decimals(set, other.tag);
        if (stated.size() != 2 || !(stated[0] > 0) || !(stated[1] > 0))
            continue;
        frame.spacing_mm = glm::dvec2(stated[1], stated[0]); // between columns, between rows
        frame.spacing_words = other.words;
        return;
    }
    take_ultrasound_spacing(set, frame);
}

StoredRange padding_of(const DataSet& set, const DicomFile& file) {
    std::optional<double> value, limit;
    switch (file.pixel_element) {
        case 0x0008:
            value = number<float>(set, Tag(0x0028, 0x0122));
            limit = number<float>(set, Tag(0x0028, 0x0124));
            break;
        case 0x0009:
            value = number<double>(set, Tag(0x0028, 0x0123));
            limit = number<double>(set, Tag(0x0028, 0x0125));
            break;
        default:
            value = whole_number(set, Tag(0x0028, 0x0120), file);
            limit = whole_number(set, Tag(0x0028, 0x0121), file);
    }
    if (!value)
        return {};
    return {std::min(*value, limit.value_or(*value)), std::max(*value, limit.value_or(*value))};
}

} // namespace palpate::io
