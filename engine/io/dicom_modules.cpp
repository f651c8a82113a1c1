#include "engine/io/dicom_modules.h"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <set>

#include "engine/base/printable.h"
#include "engine/scene/scene.h"

namespace palpate::io {

namespace {

constexpr size_t kMostValueBytes = 0xfffe; // of a value

bool only(std::string_view text, std::string_view letters) {
    return text.find_first_not_of(letters) == std::string_view::npos;
}

// Whether each of several parts has at most so many letters of UTF-8.
bool parts_fit(std::string_view value, char between, size_t most_letters) {
    size_t letters = 0;
    for (const char c : value) {
        if (c == between)
            letters = 0;
        else if ((static_cast<unsigned char>(c) & 0xc0) != 0x80 && ++letters > most_letters)
            return false;
    }
    return true;
}

// Whether the representation allows the value (PS3.5 6.2), as far as readers stumble over it.
bool is_allowed(std::string_view representation, std::string_view value) {
    constexpr std::string_view kDigits = "0123456789";
    if (representation == "DA")
        return value.size() == 8 && only(value, kDigits);
    if (representation == "TM")
        return value.size() <= 14 && only(value, "0123456789.");
    if (representation == "AS")
        return value.size() == 4 && only(value.substr(0, 3), kDigits) &&
               only(value.substr(3), "DWMY");
    if (representation == "DS")
        return value.size() <= 16 && only(value, "0123456789+-.eE");
    if (representation == "CS")
        return value.size() <= 16 && only(value, "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 _");
    if (representation == "UI") // leading zeros are met, and harm nobody
        return value.size() <= 64 && only(value, "0123456789.") && !value.starts_with('.') &&
               !value.ends_with('.') && value.find("..") == std::string_view::npos;
    if (representation == "SH")
        return parts_fit(value, '\\', 16);
    if (representation == "PN") // component groups, of one person
        return parts_fit(value, '=', 64) && std::count(value.begin(), value.end(), '=') <= 2;
    if (representation == "LO")
        return parts_fit(value, '\\', 64);
    return true;
}

} // namespace

DicomMoment moment_now() {
    const std::time_t now = std::time(nullptr);
    std::tm local{};
    ::localtime_r(&now, &local);
    char date[16], time[16];
    return {std::string(date, std::strftime(date, sizeof date, "%Y%m%d", &local)),
            std::string(time, std::strftime(time, sizeof time, "%H%M%S", &local))};
}

DicomSet object_of(const DicomParts& reference, const NewObject& object) {
    DicomSet set;
    for (const TakenAttribute& taken : kTakenAttributes) {
        const auto found = std::find_if(
            reference.attributes.begin(), reference.attributes.end(),
            [&](const DicomAttribute& attribute) { return attribute.tag == taken.tag; });
        std::string value = found == reference.attributes.end() ? "" : found->value;
        if (value.size() > kMostValueBytes || !is_allowed(taken.representation, value))
            value.clear();
        // Sex is one of three letters, or unknown (PS3.3 C.7.1.1).
        if (taken.tag == 0x00100040 && value != "M" && value != "F" && value != "O")
            value.clear();
        if (taken.always || !value.empty())
            set.text(taken.tag, taken.representation, value);
    }
    const DicomMoment now = moment_now();
    set.text(0x00080005, "CS", "ISO_IR 192")
        .text(0x00080012, "DA", now.date) // Instance Creation Date
        .text(0x00080013, "TM", now.time)
        .text(0x00080016, "UI", object.class_uid)
        .text(0x00080018, "UI", object.instance_uid)
        .text(0x00080060, "CS", object.modality)
        .text(0x00080070, "LO", "Palpate")                          // Manufacturer
        .text(0x0008103e, "LO", plain_text(object.description, 64)) // Series Description
        .text(0x00081090, "LO", "Palpate")                          // Manufacturer's Model Name
        .text(0x00181000, "LO", "0")                                // Device Serial Number
        .text(0x00181020, "LO", PALPATE_VERSION)                    // Software Versions
        .text(0x0020000d, "UI", allowed_uid(reference.study_uid))
        .text(0x0020000e, "UI", new_uid())
        .text(0x00200011, "IS", "1") // Series Number
        .text(0x00200052, "UI", allowed_uid(reference.frame_of_reference_uid));
    return set;
}

DicomSet code_item(const DicomCode& code) {
    return DicomSet()
        .text(0x00080100, "SH", code.value)
        .text(0x00080102, "SH", code.scheme)
        .text(0x00080104, "LO", code.meaning);
}

std::string allowed_uid(const std::string& uid) {
    return is_allowed("UI", uid) ? uid : std::string();
}

bool has_image(const DicomSlice& slice) {
    return !allowed_uid(slice.class_uid).empty() && !allowed_uid(slice.instance_uid).empty();
}

DicomSet instance_item(const DicomSlice& slice) {
    DicomSet set;
    set.text(0x00081150, "UI", slice.class_uid).text(0x00081155, "UI", slice.instance_uid);
    if (slice.frame > 0)
        set.text(0x00081160, "IS", std::to_string(slice.frame)); // Referenced Frame Number
    return set;
}

std::vector<DicomSlice> instances_of(const DicomParts& reference) {
    std::vector<DicomSlice> all;
    std::set<std::string> seen;
    for (const DicomSlice& slice : reference.slices)
        if (has_image(slice) && seen.insert(slice.instance_uid).second)
            all.push_back({slice.class_uid, slice.instance_uid, 0});
    return all;
}

NamedSegment named_segment(uint16_t label, std::span<const LabelName> names,
                           const SegmentCodes& codes) {
    NamedSegment segment{{}, style_of(LabelLayer(), label).color, {}};
    for (const LabelName& named : names)
        if (named.label == label) {
            segment.name = plain_text(named.name, 64);
            segment.color = named.color.value_or(segment.color);
            break;
        }
    segment.code = codes.code_of(label, segment.name);
    if (segment.name.empty())
        segment.name = fmt::format("Label {}", label);
    return segment;
}

Result<void> check_frame_of_reference(const std::string& name, const std::string& of_labels,
                                      const DicomParts& reference) {
    if (of_labels.empty() || of_labels == reference.frame_of_reference_uid)
        return {};
    return fail("{}: the labels lie in another frame of reference ({}) than the reference ({})",
                name, printable(of_labels), printable(reference.frame_of_reference_uid));
}

std::string plain_text(std::string_view text, size_t most_letters) {
    std::string out;
    size_t letters = 0;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f)
            continue;
        if ((byte & 0xc0) != 0x80 && ++letters > most_letters) // a letter of UTF-8 begins
            break;
        out += c == '\\' ? '/' : c;
    }
    while (!out.empty() && out.back() == ' ')
        out.pop_back();
    return out;
}

} // namespace palpate::io
