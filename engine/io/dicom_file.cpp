#include "engine/io/dicom_file.h"

#include <gdcmAttribute.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmUIDs.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

namespace palpate::io {

namespace {

using gdcm::DataSet;
using gdcm::Tag;

const Tag kPixels(0x7fe0, 0x0010);

// Encodings store a black image in next to nothing; this bounds what the header may claim.
constexpr double kCodecExpansion = 20000.0;

const gdcm::DataElement* element(const DataSet& set, Tag tag) {
    if (!set.FindDataElement(tag))
        return nullptr;
    const gdcm::DataElement& found = set.GetDataElement(tag);
    return found.IsEmpty() ? nullptr : &found;
}

// The text of an element without the padding DICOM gives it; empty where there is none.
std::string text(const DataSet& set, Tag tag) {
    const gdcm::DataElement* found = element(set, tag);
    const gdcm::ByteValue* bytes = found ? found->GetByteValue() : nullptr;
    if (!bytes)
        return {};
    std::string value(bytes->GetPointer(), bytes->GetLength());
    while (!value.empty() && (value.back() == ' ' || value.back() == '\0'))
        value.pop_back();
    while (!value.empty() && value.front() == ' ')
        value.erase(0, 1);
    return value;
}

// Numbers in a decimal string ("1\0\0"); empty where the element is absent or any is malformed.
std::vector<double> decimals(const DataSet& set, Tag tag) {
    std::vector<double> numbers;
    const std::string all = text(set, tag);
    for (size_t start = 0; start < all.size();) {
        const size_t end = std::min(all.find('\\', start), all.size());
        const std::string one = all.substr(start, end - start);
        char* stop = nullptr;
        numbers.push_back(std::strtod(one.c_str(), &stop));
        if (stop == one.c_str() || !std::isfinite(numbers.back()))
            return {};
        start = end + 1;
    }
    return numbers;
}

std::optional<double> decimal(const DataSet& set, Tag tag) {
    const std::vector<double> numbers = decimals(set, tag);
    return numbers.empty() ? std::nullopt : std::optional(numbers.front());
}

template <uint16_t group, uint16_t number>
std::optional<uint16_t> word(const DataSet& set) {
    const gdcm::DataElement* found = element(set, Tag(group, number));
    if (!found || !found->GetByteValue() || found->GetByteValue()->GetLength() < 2)
        return {};
    gdcm::Attribute<group, number> attribute;
    attribute.SetFromDataElement(*found);
    return attribute.GetValue();
}

// Item `index` (from 1) of a sequence; null where there is none.
gdcm::SmartPointer<gdcm::SequenceOfItems> sequence(const DataSet& set, Tag tag) {
    const gdcm::DataElement* found = element(set, tag);
    return found ? found->GetValueAsSQ() : nullptr;
}

const DataSet* item(const gdcm::SmartPointer<gdcm::SequenceOfItems>& items, size_t index) {
    return items && index >= 1 && index <= items->GetNumberOfItems()
               ? &items->GetItem(index).GetNestedDataSet()
               : nullptr;
}

struct Kind {
    const char* uid;
    const char* name;
};
// Objects that hold no image of samples, or one that is not read.
constexpr Kind kOtherKinds[] = {
    {"1.2.840.10008.5.1.4.1.1.66.4", "DICOM segmentation (SEG)"},
    {"1.2.840.10008.5.1.4.1.1.66.5", "DICOM surface segmentation"},
    {"1.2.840.10008.5.1.4.1.1.66", "DICOM raw data object"},
    {"1.2.840.10008.5.1.4.1.1.66.1", "DICOM spatial registration"},
    {"1.2.840.10008.5.1.4.1.1.481.2", "DICOM radiotherapy dose (RTDOSE)"},
    {"1.2.840.10008.5.1.4.1.1.481.3", "DICOM radiotherapy structure set (RTSTRUCT)"},
    {"1.2.840.10008.5.1.4.1.1.481.5", "DICOM radiotherapy plan (RTPLAN)"},
    {"1.2.840.10008.1.3.10", "DICOM directory (DICOMDIR)"},
};

// Places and spacings from an image's own elements, or from a functional group's.
void take_geometry(const DataSet& set, DicomFrame& frame) {
    if (const auto p = decimals(set, Tag(0x0020, 0x0032)); p.size() == 3)
        frame.position = glm::dvec3(p[0], p[1], p[2]);
    if (const auto a = decimals(set, Tag(0x0020, 0x0037)); a.size() == 6)
        frame.axes = glm::dmat2x3{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}};
    for (const Tag& tag : {Tag(0x0018, 0x1164), Tag(0x0028, 0x0030)}) // the second is preferred
        if (const auto s = decimals(set, tag); s.size() == 2 && s[0] > 0 && s[1] > 0)
            frame.spacing_mm = glm::dvec2(s[1], s[0]); // stored: between rows, between columns
    for (const Tag& tag : {Tag(0x0018, 0x0050), Tag(0x0018, 0x0088)})
        if (const auto step = decimal(set, tag); step && *step > 0)
            frame.slice_step_mm = step;
    frame.rescale.slope = decimal(set, Tag(0x0028, 0x1053)).value_or(frame.rescale.slope);
    frame.rescale.intercept = decimal(set, Tag(0x0028, 0x1052)).value_or(frame.rescale.intercept);
}

// The functional groups of an enhanced multi-frame image that place a frame.
void take_groups(const DataSet* groups, DicomFrame& frame) {
    if (!groups)
        return;
    for (const Tag& tag :
         {Tag(0x0020, 0x9113), Tag(0x0020, 0x9116), Tag(0x0028, 0x9110), Tag(0x0028, 0x9145)})
        if (const DataSet* group = item(sequence(*groups, tag), 1))
            take_geometry(*group, frame);
}

std::optional<ComponentType> component_type(uint16_t allocated, bool is_signed) {
    switch (allocated) {
        case 8:
            return is_signed ? ComponentType::i8 : ComponentType::u8;
        case 16:
            return is_signed ? ComponentType::i16 : ComponentType::u16;
        case 32:
            return is_signed ? ComponentType::i32 : ComponentType::u32;
        default:
            return {};
    }
}

double most_expansion(const gdcm::TransferSyntax& syntax) {
    if (syntax == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian)
        return kDeflateExpansion;
    return syntax.IsEncapsulated() ? kCodecExpansion : kRawExpansion;
}

// Refuses what is not an image of one grey value a sample.
Result<void> check_kind(const std::string& name, const DataSet& set, const std::string& kind) {
    for (const Kind& other : kOtherKinds)
        if (kind == other.uid)
            return fail("{}: is a {}, expected a DICOM image", name, other.name);
    if (!word<0x0028, 0x0010>(set) || !word<0x0028, 0x0011>(set))
        return fail("{}: is a DICOM file without an image (class {})", name,
                    kind.empty() ? "unknown" : kind);
    const std::string colours = text(set, Tag(0x0028, 0x0004));
    if (word<0x0028, 0x0002>(set).value_or(1) != 1 || colours == "PALETTE COLOR")
        return fail("{}: holds colours ({}), expected one grey value a sample", name, colours);
    return {};
}

// GDCM fills what is cut off with something: finds it out beforehand. The pixels start at byte
// `start`. Deflated files are checked by their own sum.
Result<void> check_pixels(const DicomFile& file, const gdcm::TransferSyntax& syntax, uint64_t start,
                          double claimed_bytes) {
    const std::string name = file.path.string();
    if (syntax == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian)
        return {};
    if (start > file.bytes)
        return fail("{}: ends before its pixels", name);
    const uint64_t held = file.bytes - start;
    if (!syntax.IsEncapsulated()) {
        if (claimed_bytes > static_cast<double>(held))
            return fail("{}: is cut off: expected {:.0f} bytes of pixels, found {}", name,
                        claimed_bytes, held);
        return {};
    }
    // Items follow one another, each with its length (PS3.5 A.4), up to a delimiter.
    std::ifstream in(file.path, std::ios::binary);
    uint64_t at = start;
    for (;;) {
        uint8_t head[8];
        in.seekg(static_cast<std::streamoff>(at));
        if (!in.read(reinterpret_cast<char*>(head), sizeof head))
            return fail("{}: is cut off: its encoded pixels have no end within its {} bytes", name,
                        file.bytes);
        if (head[0] != 0xfe || head[1] != 0xff || head[3] != 0xe0)
            return fail("{}: its encoded pixels are damaged at byte {}", name, at);
        if (head[2] == 0xdd)
            return {};
        at += sizeof head + (head[4] | head[5] << 8 | head[6] << 16 | uint64_t{head[7]} << 24);
    }
}

} // namespace

Result<DicomFile> read_dicom_header(const std::filesystem::path& path) {
    const std::string name = path.string();
    const Result<uint64_t> bytes = regular_file_bytes(path);
    if (!bytes)
        return fail("{}", bytes.error().message);
    gdcm::Reader reader;
    reader.SetFileName(path.c_str());
    // Skipped, the pixels are not read: the stream then stands at their first byte.
    if (!reader.ReadUpToTag(kPixels, {kPixels}))
        return fail("{}: is no DICOM file, or a damaged one", name);
    const DataSet& set = reader.GetFile().GetDataSet();
    const gdcm::TransferSyntax& syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();

    std::string kind = text(set, Tag(0x0008, 0x0016));
    if (kind.empty())
        kind = text(reader.GetFile().GetHeader(), Tag(0x0002, 0x0002));
    if (Result<void> checked = check_kind(name, set, kind); !checked)
        return pass_on(checked);

    DicomFile file;
    file.path = path;
    file.bytes = *bytes;
    file.most_expansion = most_expansion(syntax);
    const uint16_t allocated = word<0x0028, 0x0100>(set).value_or(0);
    const std::optional<ComponentType> type =
        component_type(allocated, word<0x0028, 0x0103>(set).value_or(0) == 1);
    if (!type)
        return fail("{}: holds samples of {} bits, expected 8, 16 or 32", name, allocated);
    file.type = *type;
    if (element(set, Tag(0x0028, 0x3000)))
        file.warnings.push_back(name + ": its modality look-up table is not applied");

    DicomFrame frame;
    frame.file = path;
    frame.series_uid = text(set, Tag(0x0020, 0x000e));
    frame.series_description = text(set, Tag(0x0008, 0x103e));
    frame.modality = text(set, Tag(0x0008, 0x0060));
    frame.instance_uid = text(set, Tag(0x0008, 0x0018));
    frame.instance_number = static_cast<int64_t>(decimal(set, Tag(0x0020, 0x0013)).value_or(0.0));
    frame.size = {*word<0x0028, 0x0011>(set), *word<0x0028, 0x0010>(set)};
    take_geometry(set, frame);

    const double count = decimal(set, Tag(0x0028, 0x0008)).value_or(1.0);
    const double claimed =
        count * frame.size.x * frame.size.y * static_cast<double>(bytes_per_component(*type));
    if (!(claimed > 0) || claimed > most_expansion(syntax) * static_cast<double>(*bytes))
        return fail("{}: claims {} frames of {} x {} samples of {}, but holds only {} bytes", name,
                    count, frame.size.x, frame.size.y, name_of(*type), *bytes);
    if (Result<void> whole = check_pixels(file, syntax, reader.GetStreamCurrentPosition(), claimed);
        !whole)
        return pass_on(whole);
    const auto shared = sequence(set, Tag(0x5200, 0x9229));
    const auto per_frame = sequence(set, Tag(0x5200, 0x9230));
    take_groups(item(shared, 1), frame);
    if (count > 1)
        frame.position.reset(); // one place cannot be every frame's
    for (uint32_t i = 0; i < static_cast<uint32_t>(count); ++i) {
        DicomFrame& one = file.frames.emplace_back(frame);
        one.frame = i;
        if (count > 1)
            one.instance_number = i;
        take_groups(item(per_frame, i + 1), one);
    }
    return file;
}

Result<std::vector<char>> read_dicom_pixels(const DicomFile& file) {
    const std::string name = file.path.string();
    gdcm::ImageReader reader;
    reader.SetFileName(file.path.c_str());
    if (!reader.Read())
        return fail("{}: its pixels cannot be read (transfer syntax {})", name,
                    reader.GetFile().GetHeader().GetDataSetTransferSyntax().GetString());
    const gdcm::Image& image = reader.GetImage();
    const glm::uvec2 size = file.frames.front().size;
    const uint64_t expected =
        uint64_t{size.x} * size.y * file.frames.size() * bytes_per_component(file.type);
    if (image.GetBufferLength() != expected)
        return fail("{}: its pixels have {} bytes, expected {} ({} frames of {} x {} of {})", name,
                    image.GetBufferLength(), expected, file.frames.size(), size.x, size.y,
                    name_of(file.type));
    std::vector<char> pixels(expected);
    if (!image.GetBuffer(pixels.data()))
        return fail("{}: its pixels cannot be decoded (transfer syntax {})", name,
                    image.GetTransferSyntax().GetString());
    return pixels;
}

} // namespace palpate::io
