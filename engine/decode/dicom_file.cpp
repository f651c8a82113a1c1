#include "engine/decode/dicom_file.h"

#include <gdcmPixmapReader.h>
#include <gdcmReader.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/printable.h"
#include "engine/decode/dicom_codestream.h"
#include "engine/decode/dicom_elements.h"
#include "engine/decode/dicom_geometry.h"
#include "engine/decode/dicom_marks.h"
#include "engine/decode/dicom_mosaic.h"
#include "engine/decode/dicom_source.h"
#include "engine/decode/dicom_spacing.h"
#include "engine/decode/dicom_structure.h"

namespace palpate::io {

namespace {

using gdcm::DataSet;
using gdcm::Tag;

constexpr uint16_t kPixelGroup = 0x7fe0, kFloats = 0x0008, kDoubles = 0x0009;

bool is_floating(uint16_t pixel_element) {
    return pixel_element == kFloats || pixel_element == kDoubles;
}

// Encodings store a black image in next to nothing; this bounds what the header may claim.
constexpr double kCodecExpansion = 20000.0;

struct Kind {
    const char* uid;
    const char* name;
};
// Objects that hold no image of samples, or one that is not read.
constexpr Kind kOtherKinds[] = {
    {"1.2.840.10008.5.1.4.1.1.66.8", "DICOM height map segmentation"},
    {"1.2.840.10008.5.1.4.1.1.66.5", "DICOM surface segmentation"},
    {"1.2.840.10008.5.1.4.1.1.66", "DICOM raw data object"},
    {"1.2.840.10008.5.1.4.1.1.66.1", "DICOM spatial registration"},
    {"1.2.840.10008.5.1.4.1.1.481.2", "DICOM radiotherapy dose (RTDOSE)"},
    {"1.2.840.10008.5.1.4.1.1.481.3", "DICOM radiotherapy structure set (RTSTRUCT)"},
    {"1.2.840.10008.5.1.4.1.1.481.5", "DICOM radiotherapy plan (RTPLAN)"},
    {"1.2.840.10008.1.3.10", "DICOM directory (DICOMDIR)"},
};
constexpr const char* kSegmentationKinds[] = {"1.2.840.10008.5.1.4.1.1.66.4",
                                              "1.2.840.10008.5.1.4.1.1.66.7"};

std::optional<ComponentType> component_type(uint16_t allocated, bool is_signed,
                                            uint16_t pixel_element) {
    if (pixel_element == kFloats)
        return allocated == 32 ? std::optional(ComponentType::f32) : std::nullopt;
    if (pixel_element == kDoubles)
        return allocated == 64 ? std::optional(ComponentType::f64) : std::nullopt;
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

constexpr const char* kBigEndian = "1.2.840.10008.1.2.2";
constexpr const char* kPrivateBigEndian = "1.2.840.113619.5.2"; // of GE

// Why an object is not read; empty where it is an image of one grey value a sample.
std::string refusal_of(const DataSet& set, const std::string& kind, bool segmentation,
                       const DicomFile& file) {
    for (const Kind& other : kOtherKinds)
        if (kind == other.uid)
            return fmt::format("is a {}, expected a DICOM image", other.name);
    if (!word<0x0028, 0x0010>(set) || !word<0x0028, 0x0011>(set))
        return fmt::format("is a DICOM file without an image (class {})",
                           kind.empty() ? "unknown" : printable(kind));
    const std::string colours = text(set, Tag(0x0028, 0x0004));
    if (word<0x0028, 0x0002>(set).value_or(1) != 1 || (colours == "PALETTE COLOR" && !segmentation))
        return fmt::format("holds colours ({}), expected one grey value a sample",
                           printable(colours));
    const uint16_t allocated = word<0x0028, 0x0100>(set).value_or(0);
    const bool floating = is_floating(file.pixel_element);
    if (!(segmentation && allocated == 1) && !component_type(allocated, false, file.pixel_element))
        return fmt::format("holds {}samples of {} bits, expected {}",
                           floating ? "floating-point " : "", allocated,
                           !floating                       ? "8, 16 or 32"
                           : file.pixel_element == kFloats ? "32"
                                                           : "64");
    if (floating && file.encapsulated)
        return "holds encoded floating-point pixels, which DICOM does not have";
    return {};
}

// Gives segments the labels that our writer kept, where each has another one that rises with the
// numbers of segments.
void take_own_labels(const std::vector<uint32_t>& own, Segmentation& segmentation) {
    std::vector<LabelName>& segments = segmentation.segments;
    if (own.size() != segments.size() || own.empty() || own.front() == 0 ||
        segmentation.kind == SegmentationKind::label_map)
        return;
    for (size_t i = 1; i < own.size(); ++i)
        if (own[i] <= own[i - 1] || segments[i].label <= segments[i - 1].label)
            return;
    for (size_t i = 0; i < own.size(); ++i) {
        segmentation.label_of[segments[i].label] = own[i];
        segments[i].label = own[i];
    }
}

Result<Segmentation> segmentation_of(const std::string& name, const DataSet& set) {
    constexpr const char* kKinds[] = {"BINARY", "FRACTIONAL", "LABELMAP"};
    const std::string kind = text(set, Tag(0x0062, 0x0001));
    const auto* found = std::find(std::begin(kKinds), std::end(kKinds), kind);
    if (found == std::end(kKinds))
        return fail("{}: is a segmentation of type '{}', expected BINARY, FRACTIONAL or LABELMAP",
                    name, printable(kind));
    Segmentation segmentation;
    std::vector<uint32_t> own; // the labels that our writer keeps
    segmentation.kind = static_cast<SegmentationKind>(found - std::begin(kKinds));
    segmentation.largest_fraction = word<0x0062, 0x000e>(set).value_or(1);
    if (segmentation.kind == SegmentationKind::fractional &&
        (segmentation.largest_fraction == 0 || !word<0x0062, 0x000e>(set)))
        return fail("{}: is a fractional segmentation without its largest value", name);
    const DicomItems segments(set, Tag(0x0062, 0x0002));
    for (size_t i = 0; const DicomItem segment = segments.at(i); ++i) {
        LabelName& label = segmentation.segments.emplace_back();
        label.label = word<0x0062, 0x0004>(*segment).value_or(0);
        label.name = text(*segment, Tag(0x0062, 0x0005));
        if (const auto tag = private_tag(*segment, kPrivateLabelTag >> 16, kPrivateCreator,
                                         kPrivateLabelTag & 0xff))
            own.push_back(number<uint16_t>(*segment, *tag).value_or(0));
        if (const auto lab = numbers<uint16_t>(*segment, Tag(0x0062, 0x000d)); lab.size() == 3)
            label.color =
                color_of_cielab({lab[0] / 65535.0 * 100.0, lab[1] / 65535.0 * 255.0 - 128.0,
                                 lab[2] / 65535.0 * 255.0 - 128.0});
    }
    take_own_labels(own, segmentation);
    return segmentation;
}

// The instance of which an image was made; empty where it states none, or several.
std::string only_source_of(const DataSet& set) {
    const DicomItems sources(set, Tag(0x0008, 0x2112));
    const DicomItem source = sources.at(0);
    return sources.size() == 1 ? text(*source, Tag(0x0008, 0x1155)) : std::string();
}

// GDCM fills what is cut off with something: finds it out beforehand. The pixels start at byte
// `start`. Deflated files are checked by their own sum.
Result<void> check_pixels(const DicomFile& file, double claimed_bytes) {
    const std::string name = file.path.string();
    if (file.deflated_at > 0)
        return {};
    if (file.pixels_at > file.bytes)
        return fail("{}: ends before its pixels", name);
    const uint64_t held = file.bytes - file.pixels_at;
    if (!file.encapsulated) {
        if (claimed_bytes > static_cast<double>(held))
            return fail("{}: is cut off: expected {:.0f} bytes of pixels, found {}", name,
                        claimed_bytes, held);
        return {};
    }
    PALPATE_TRY(encoded_items(file));
    return {};
}

// Makes values of type T of the `stored` bits that end at `high_bit`, whatever the other bits hold.
template <class T>
void take_bits(std::vector<char>& pixels, uint32_t stored, uint32_t high_bit) {
    using Unsigned = std::make_unsigned_t<T>;
    const uint32_t up = 8 * sizeof(T) - 1 - high_bit, down = 8 * sizeof(T) - stored;
    for (size_t at = 0; at + sizeof(T) <= pixels.size(); at += sizeof(T)) {
        Unsigned value;
        std::memcpy(&value, &pixels[at], sizeof value);
        value = static_cast<Unsigned>(value << up);
        const T extended = static_cast<T>(static_cast<T>(value) >> down);
        std::memcpy(&pixels[at], &extended, sizeof extended);
    }
}

void take_bits(const DicomFile& file, uint32_t high_bit, std::vector<char>& pixels) {
    const auto all = static_cast<uint32_t>(8 * bytes_per_component(file.type));
    if (file.bits_stored == 0 || file.bits_stored >= all || high_bit >= all ||
        high_bit + 1 < file.bits_stored)
        return;
    visit_component(file.type, [&](auto t) {
        if constexpr (std::is_integral_v<decltype(t)>)
            take_bits<decltype(t)>(pixels, file.bits_stored, high_bit);
    });
}

// A reader of images would parse geometry, too, and ends the process where an element is absent
// that it takes for granted: the position of a nuclear detector, say.
Result<std::vector<char>> decode_pixels(const DicomFile& file) {
    const std::string name = file.path.string();
    gdcm::PixmapReader reader;
    PALPATE_TRY(const auto stream, give_file(reader, file.path, file.deflated_at,
                                             std::numeric_limits<uint64_t>::max()));
    if (!reader.Read())
        return fail("{}: its pixels cannot be read (transfer syntax {})", name, file.syntax);
    const gdcm::Pixmap& image = reader.GetPixmap();
    std::vector<char> pixels(image.GetBufferLength());
    if (!image.GetBuffer(pixels.data()))
        return fail("{}: its pixels cannot be decoded (transfer syntax {})", name, file.syntax);
    return pixels;
}

bool is_signed(ComponentType type) {
    return type == ComponentType::i8 || type == ComponentType::i16 || type == ComponentType::i32;
}

// Samples that are stored as they are. Big-endian ones GDCM puts in order.
bool is_plain(const DicomFile& file) {
    return !file.encapsulated && file.syntax != kBigEndian && file.syntax != kPrivateBigEndian;
}

} // namespace

bool looks_like_dicom(std::string_view bytes, const std::string& extension) {
    if (bytes.size() >= 132 && bytes.substr(128, 4) == "DICM")
        return true;
    if (extension == ".dcm" || extension == ".ima" || extension == ".dicom")
        return true;
    // Without the preamble a data set begins with a small element of group 0008, little-endian.
    return bytes.size() >= 8 && bytes.starts_with(std::string_view("\x08\0", 2)) && bytes[3] == 0;
}

Result<DicomFile> read_dicom_header(const std::filesystem::path& path) {
    const std::string name = path.string();
    PALPATE_TRY(const uint64_t bytes, regular_file_bytes(path));
    PALPATE_TRY(const DicomStructure structure, check_structure(path));
    const uint16_t pixel_element =
        is_floating(structure.pixel_element) ? structure.pixel_element : uint16_t{0x0010};
    const Tag pixels(kPixelGroup, pixel_element);
    gdcm::Reader reader;
    PALPATE_TRY(const auto stream,
                give_file(reader, path, structure.deflated_at, structure.pixels_at));
    // Skipped, the pixels are not read: the stream then stands at their first byte.
    if (!reader.ReadUpToTag(pixels, {pixels}))
        return fail("{}: is no DICOM file, or a damaged one: no data set in transfer syntax '{}'",
                    name, printable(structure.syntax));
    const DataSet& set = reader.GetFile().GetDataSet();
    const gdcm::TransferSyntax& syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();

    std::string kind = text(set, Tag(0x0008, 0x0016));
    if (kind.empty())
        kind = text(reader.GetFile().GetHeader(), Tag(0x0002, 0x0002));
    const bool segmentation =
        std::find(std::begin(kSegmentationKinds), std::end(kSegmentationKinds), kind) !=
        std::end(kSegmentationKinds);
    DicomFile file;
    file.path = path;
    file.bytes = bytes;
    file.pixel_element = pixel_element;
    file.pixels_at = reader.GetStreamCurrentPosition();
    file.syntax = structure.deflated_at > 0 ? kDeflatedSyntax : syntax.GetString();
    file.deflated_at = structure.deflated_at;
    file.encapsulated = syntax.IsEncapsulated();
    file.most_expansion = structure.deflated_at > 0 ? kDeflateExpansion
                          : file.encapsulated       ? kCodecExpansion
                                                    : kRawExpansion;

    DicomFrame frame;
    frame.file = path;
    frame.series_uid = text(set, Tag(0x0020, 0x000e));
    frame.series_description = text(set, Tag(0x0008, 0x103e));
    frame.modality = text(set, Tag(0x0008, 0x0060));
    frame.class_uid = kind;
    frame.instance_uid = text(set, Tag(0x0008, 0x0018));
    frame.frame_of_reference = text(set, Tag(0x0020, 0x0052));
    frame.instance_number = static_cast<int64_t>(decimal(set, Tag(0x0020, 0x0013)).value_or(0.0));
    file.refusal = refusal_of(set, kind, segmentation, file);
    if (!file.refusal.empty()) {
        frame.object = DicomObject::other;
        frame.object_words = file.refusal;
        file.frames = {frame};
        return file;
    }
    const uint16_t allocated = word<0x0028, 0x0100>(set).value_or(0);
    file.type = *component_type(allocated == 1 ? 8 : allocated,
                                word<0x0028, 0x0103>(set).value_or(0) == 1, pixel_element);
    file.bits_allocated = allocated;
    file.bits_stored = word<0x0028, 0x0101>(set).value_or(allocated);
    file.high_bit = word<0x0028, 0x0102>(set).value_or(file.bits_stored - 1);
    if (element(set, Tag(0x0028, 0x3000)))
        file.warnings.push_back(name + ": its modality look-up table is not applied");

    frame.size = {*word<0x0028, 0x0011>(set), *word<0x0028, 0x0010>(set)};
    take_geometry(set, frame);
    take_other_spacing(set, frame);
    take_marks(set, frame.marks);
    frame.padding = padding_of(set, file);
    if (text(set, Tag(0x0028, 0x2110)) == "01")
        frame.lossless_uid = only_source_of(set);
    frame.inverted = text(set, Tag(0x0028, 0x0004)) == "MONOCHROME1";
    const double count = decimal(set, Tag(0x0028, 0x0008)).value_or(1.0);
    const double claimed = std::ceil(count * frame.size.x * frame.size.y * allocated / 8.0);
    if (!(claimed > 0) || claimed > file.most_expansion * static_cast<double>(bytes))
        return fail("{}: claims {} frames of {} x {} samples of {} bits, but holds only {} bytes",
                    name, count, frame.size.x, frame.size.y, allocated, bytes);
    PALPATE_TRY(check_pixels(file, claimed));
    if (segmentation) {
        PALPATE_TRY(file.segmentation, segmentation_of(name, set));
        frame.object = DicomObject::segmentation;
    } else if (is_mosaic(set) && count == 1) {
        PALPATE_TRY(std::vector<DicomFrame> tiles, mosaic_frames(name, set, frame));
        file.mosaic = frame.size;
        file.frames = std::move(tiles);
        return file;
    }
    PALPATE_TRY(file.frames,
                frames_of(name, set, frame, static_cast<uint32_t>(count), file.warnings));
    for (DicomFrame& one : file.frames)
        if (segmentation && !file.segmentation->label_of.empty()) {
            const auto label = file.segmentation->label_of.find(one.segment);
            one.segment = label == file.segmentation->label_of.end() ? 0 : label->second;
        }
    return file;
}

Result<std::vector<char>> read_dicom_pixels(const DicomFile& file) {
    const std::string name = file.path.string();
    PALPATE_TRY(const uint32_t stream_bits, check_codestreams(file));
    const bool plain = is_plain(file) || is_floating(file.pixel_element);
    PALPATE_TRY(std::vector<char> pixels, plain ? read_dicom_bytes(file) : decode_pixels(file));
    const glm::uvec2 size = file.frames.front().size;
    const uint64_t images = file.mosaic ? 1 : file.frames.size();
    const glm::uvec2 plane = file.mosaic.value_or(size);
    const uint64_t expected = uint64_t{plane.x} * plane.y * images * bytes_per_component(file.type);
    if (pixels.size() > expected && !file.encapsulated)
        pixels.resize(expected); // padded to an even length
    if (pixels.size() != expected)
        return fail("{}: its pixels have {} bytes, expected {} ({} frames of {} x {} of {})", name,
                    pixels.size(), expected, images, plane.x, plane.y, name_of(file.type));
    // Decoders put samples at the low end of their words. A codestream that is signed itself, and
    // has more bits than the header says, knows better.
    if (is_plain(file))
        take_bits(file, file.high_bit, pixels);
    else if (is_signed(file.type) && stream_bits <= file.bits_stored)
        take_bits(file, file.bits_stored - 1, pixels);
    if (file.mosaic)
        return untile(pixels, plane, size, file.frames.size(), bytes_per_component(file.type));
    return pixels;
}

Result<std::vector<char>> read_dicom_bytes(const DicomFile& file) {
    const std::string name = file.path.string();
    gdcm::Reader reader;
    PALPATE_TRY(const auto stream, give_file(reader, file.path, file.deflated_at,
                                             std::numeric_limits<uint64_t>::max()));
    const gdcm::DataElement* found =
        reader.Read() ? element(reader.GetFile().GetDataSet(), Tag(kPixelGroup, file.pixel_element))
                      : nullptr;
    const gdcm::ByteValue* bytes = found ? found->GetByteValue() : nullptr;
    if (!bytes)
        return fail("{}: its pixels cannot be read (transfer syntax {})", name, file.syntax);
    return std::vector<char>(bytes->GetPointer(), bytes->GetPointer() + bytes->GetLength());
}

} // namespace palpate::io
