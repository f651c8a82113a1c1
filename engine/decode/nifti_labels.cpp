#include "engine/decode/nifti_labels.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <pugixml.hpp>

#include "engine/decode/header_fields.h"

namespace palpate::io {

namespace {

constexpr int32_t kCaret = 30;                // NIFTI_ECODE_CARET of nifti1_io.h
constexpr int32_t kUnknown = 0;               // as TotalSegmentator writes it
constexpr uint64_t kMost = uint64_t{4} << 20; // bytes of an extension that is looked at
constexpr size_t kMostLabels = 65535;

// The text of the first extension of Caret; empty where there is none.
Result<std::string> caret_text(const std::filesystem::path& path, Packing packing,
                               const NiftiHeader& header, std::vector<std::string>& warnings) {
    PALPATE_TRY(ByteSource source, ByteSource::open(path, packing));
    const bool second = header.kind == NiftiHeader::Kind::nifti2;
    const uint64_t begin = second ? kNifti2Bytes : kNifti1Bytes;
    PALPATE_TRY(const uint64_t passed, source.skip(begin));
    std::array<std::byte, 8> head{};
    PALPATE_TRY(const size_t flags, source.read(std::span(head).first(4)));
    if (passed < begin || flags < 4 || head[0] == std::byte{0})
        return std::string();
    // The extensions of a pair end with the file.
    if (!header.pair && !(header.vox_offset >= 0 && header.vox_offset < 9e15))
        return std::string(); // refused with the voxels
    const uint64_t end = header.pair ? uint64_t{1} << 53 : static_cast<uint64_t>(header.vox_offset);
    for (uint64_t at = begin + 4; at + head.size() <= end;) {
        PALPATE_TRY(const size_t got, source.read(head));
        const HeaderFields fields(head, header.big_endian);
        const int64_t size = got < head.size() ? 0 : fields.at<int32_t>(0);
        if (size == 0) // the end of the file, or room that was left
            return std::string();
        // A size that is no multiple of 16 is taken as it is; nibabel does so too.
        const uint64_t bytes = static_cast<uint64_t>(std::max<int64_t>(size, 8)) - head.size();
        uint64_t held = 0;
        if (size >= 8 && bytes <= end - at - head.size()) {
            const int32_t code = fields.at<int32_t>(4);
            if ((code == kCaret || code == kUnknown) && bytes <= kMost) {
                std::string text(bytes, '\0');
                PALPATE_TRY(held, source.read(std::as_writable_bytes(std::span(text))));
                text.resize(std::min(held, text.find('\0')));
                if (held == bytes && text.find("<CaretExtension") != std::string::npos)
                    return text;
            } else {
                PALPATE_TRY(held, source.skip(bytes));
            }
        }
        if (size < 8 || held < bytes) {
            warnings.push_back(fmt::format(
                "{}: its extension at byte {} is left out: it claims {} bytes, expected 8 or more, "
                "before {}",
                path.string(), at, size,
                header.pair ? "the end of the file"
                            : fmt::format("the voxels at byte {} and the end of the file", end)));
            return std::string();
        }
        at += bytes + head.size();
    }
    return std::string();
}

std::optional<glm::dvec3> color_of(const pugi::xml_node& label) {
    glm::dvec3 color;
    constexpr const char* names[] = {"Red", "Green", "Blue"};
    for (int i = 0; i < 3; ++i) {
        const pugi::xml_attribute share = label.attribute(names[i]);
        color[i] = share.as_double(NAN);
        if (!(color[i] >= 0.0 && color[i] <= 1.0))
            return std::nullopt;
    }
    return color;
}

} // namespace

std::vector<LabelName> nifti_label_names(const std::filesystem::path& path, Packing packing,
                                         const NiftiHeader& header,
                                         std::vector<std::string>& warnings) {
    std::vector<LabelName> names;
    if (header.kind == NiftiHeader::Kind::analyze)
        return names;
    const Result<std::string> text = caret_text(path, packing, header, warnings);
    if (!text || text->empty())
        return names; // damage is told with the voxels
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(text->data(), text->size());
    if (!parsed) {
        warnings.push_back(fmt::format("{}: the table of its labels is left out: expected XML, {}",
                                       path.string(), parsed.description()));
        return names;
    }
    const pugi::xml_node table =
        document.child("CaretExtension").child("VolumeInformation").child("LabelTable");
    for (const pugi::xml_node label : table.children("Label")) {
        const int key = label.attribute("Key").as_int(0);
        if (key <= 0 || names.size() == kMostLabels)
            continue;
        names.push_back({static_cast<uint32_t>(key), label.child_value(), color_of(label)});
    }
    return names;
}

} // namespace palpate::io
