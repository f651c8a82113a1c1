#include "engine/io/dicom_labels_write.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "engine/base/file.h"
#include "engine/io/dicom_modules.h"
#include "engine/io/label_slices.h"
#include "engine/io/output_file.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

using io::DicomSet;
using io::LabelSlices;

constexpr size_t kMostLabels = 65536;
constexpr uint64_t kMostPixelBytes = 0xfffffffe; // of one element (PS3.5 7.1.1)
constexpr const char* kSegClass = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* kLabelMapClass = "1.2.840.10008.5.1.4.1.1.66.7";
constexpr uint8_t kFull = 255; // of a fractional segmentation

// One frame of the file: a slice of the reference, and its segment by number; 0 of a label map.
struct SegFrame {
    uint32_t slice;
    uint16_t segment;
};

// The labels and slices that the map has, on the reference's grid.
struct Layout {
    LabelSlices slices;
    std::vector<uint16_t> labels; // by rising number: segment 1 is labels[0]
    std::vector<SegFrame> frames; // by slice, then by segment
};

Result<Layout> lay_out(const std::string& name, const Volume& labels, const Grid& grid,
                       const DicomLabelOptions& options) {
    Result<LabelSlices> slices = LabelSlices::make(labels, grid);
    if (!slices)
        return fail("{}: {}", name, slices.error().message);
    const auto seen = std::make_unique<std::bitset<kMostLabels>>();
    std::map<uint32_t, std::vector<uint16_t>> in_slice;
    PALPATE_TRY(slices->visit(
        name, options.stop,
        [&](uint32_t k, std::span<const uint16_t>, const std::vector<uint16_t>& found) {
            for (const uint16_t label : found)
                seen->set(label);
            in_slice[k] = found;
        }));
    Layout layout{std::move(*slices), {}, {}};
    std::vector<uint16_t> number_of(kMostLabels);
    for (size_t label = 1; label < kMostLabels; ++label)
        if (seen->test(label)) {
            layout.labels.push_back(static_cast<uint16_t>(label));
            number_of[label] = static_cast<uint16_t>(layout.labels.size());
        }
    for (uint32_t k = 0; k < grid.size.z; ++k) {
        const auto found = in_slice.find(k);
        if (options.kind == DicomLabels::label_map)
            layout.frames.push_back({k, 0});
        else if (found != in_slice.end())
            for (const uint16_t label : found->second)
                layout.frames.push_back({k, number_of[label]});
        else if (k == 0 || k + 1 == grid.size.z)
            layout.frames.push_back({k, 1}); // so that readers find both ends of the grid
    }
    return layout;
}

DicomSet segment_item(uint16_t number, uint16_t label, std::span<const LabelName> names,
                      const DicomLabelOptions& options) {
    const io::NamedSegment segment = io::named_segment(label, names, options.codes);
    const glm::dvec3 lab = cielab_of_color(segment.color);
    const auto word = [](double share) {
        return static_cast<uint16_t>(std::lround(std::clamp(share, 0.0, 1.0) * 65535.0));
    };
    DicomSet type = io::code_item(segment.code.type);
    if (segment.code.modifier)
        type.sequence(0x00620011, {io::code_item(*segment.code.modifier)});
    DicomSet item;
    item.word(0x00620004, number)
        .text(0x00620005, "LO", segment.name)
        .text(0x00620008, "CS", "SEMIAUTOMATIC") // Segment Algorithm Type
        .text(0x00620009, "LO", "Palpate")       // Segment Algorithm Name
        .words(0x0062000d,
               {word(lab.x / 100), word((lab.y + 128) / 255), word((lab.z + 128) / 255)})
        .sequence(0x00620003, {io::code_item(segment.code.category)})
        .sequence(0x0062000f, {type});
    if (options.kind != DicomLabels::label_map) // there the number is the label
        item.text(io::kPrivateCreatorTag, "LO", io::kPrivateCreator)
            .words(io::kPrivateLabelTag, {label});
    return item;
}

DicomSet dimension_item(uint32_t element, uint32_t group, const std::string& organization,
                        const char* label) {
    return DicomSet()
        .text(0x00209164, "UI", organization)
        .tag_value(0x00209165, element)
        .tag_value(0x00209167, group)
        .text(0x00209421, "LO", label);
}

// Orientation and distances, the same for all frames.
DicomSet shared_item(const Grid& grid) {
    const glm::dvec3 mm = spacing_mm(grid);
    const glm::dvec3 row = glm::dvec3(grid.world_from_index[0]) / mm.x;
    const glm::dvec3 column = glm::dvec3(grid.world_from_index[1]) / mm.y;
    const double apart = // along the normal, also of sheared stacks
        std::abs(glm::dot(glm::normalize(glm::cross(row, column)),
                          glm::dvec3(grid.world_from_index[2])));
    return DicomSet()
        .sequence(0x00209116, {DicomSet().decimals(
                                  0x00200037, {row.x, row.y, row.z, column.x, column.y, column.z})})
        .sequence(0x00289110, {DicomSet()
                                   .decimals(0x00180050, {apart}) // Slice Thickness
                                   .decimals(0x00180088, {apart}) // Spacing Between Slices
                                   .decimals(0x00280030, {mm.y, mm.x})});
}

DicomSet frame_item(const SegFrame& frame, const DicomReference& reference) {
    const glm::dvec3 at = world_point(reference.grid, {0, 0, frame.slice});
    const DicomSlice& source = reference.parts.slices[frame.slice];
    std::vector<DicomSet> derivation;
    if (io::has_image(source))
        derivation.push_back(
            DicomSet()
                .sequence(
                    0x00082112,
                    {io::instance_item(source)
                         .text(0x0028135a, "CS", "YES") // Spatial Locations Preserved
                         .sequence(0x0040a170, {io::code_item({"DCM", "121322",
                                                               "Source image for image processing "
                                                               "operation"})})})
                .sequence(0x00089215, {io::code_item({"DCM", "113076", "Segmentation"})}));
    std::vector<uint32_t> indices{frame.slice + 1};
    if (frame.segment > 0)
        indices.insert(indices.begin(), frame.segment);
    DicomSet item;
    item.sequence(0x00089124, derivation)
        .sequence(0x00209111, {DicomSet().longs(0x00209157, indices)})
        .sequence(0x00209113, {DicomSet().decimals(0x00200032, {at.x, at.y, at.z})});
    if (frame.segment > 0)
        item.sequence(0x0062000a, {DicomSet().word(0x0062000b, frame.segment)});
    return item;
}

DicomSet references_item(const DicomParts& parts) {
    std::vector<DicomSet> instances;
    for (const DicomSlice& instance : io::instances_of(parts))
        instances.push_back(io::instance_item(instance));
    return DicomSet()
        .text(0x0020000e, "UI", io::allowed_uid(parts.series_uid))
        .sequence(0x0008114a, instances);
}

// Everything before the pixels.
DicomSet header_of(const Layout& layout, std::span<const LabelName> names,
                   const DicomReference& reference, const DicomLabelOptions& options,
                   const std::string& instance, uint16_t bits) {
    const bool label_map = options.kind == DicomLabels::label_map;
    DicomSet set = io::object_of(
        reference.parts, {label_map ? kLabelMapClass : kSegClass, instance, "SEG",
                          options.description.empty() ? "Segmentation" : options.description});
    const io::DicomMoment now = io::moment_now();
    const std::string organization = io::new_uid();
    std::vector<DicomSet> segments, frames, dimensions;
    for (size_t i = 0; i < layout.labels.size(); ++i) {
        const uint16_t label = layout.labels[i];
        segments.push_back(
            segment_item(label_map ? label : static_cast<uint16_t>(i + 1), label, names, options));
    }
    for (const SegFrame& frame : layout.frames)
        frames.push_back(frame_item(frame, reference));
    if (!label_map)
        dimensions.push_back(
            dimension_item(0x0062000b, 0x0062000a, organization, "ReferencedSegmentNumber"));
    dimensions.push_back(
        dimension_item(0x00200032, 0x00209113, organization, "ImagePositionPatient"));
    set.text(0x00080008, "CS", "DERIVED\\PRIMARY")
        .text(0x00080023, "DA", now.date) // Content Date
        .text(0x00080033, "TM", now.time)
        .sequence(0x00081115, {references_item(reference.parts)})
        .text(0x00200013, "IS", "1") // Instance Number
        .sequence(0x00209221, {DicomSet().text(0x00209164, "UI", organization)})
        .sequence(0x00209222, dimensions)
        .word(0x00280002, 1)
        .text(0x00280004, "CS", "MONOCHROME2")
        .text(0x00280008, "IS", std::to_string(layout.frames.size()))
        .word(0x00280010, static_cast<uint16_t>(reference.grid.size.y))
        .word(0x00280011, static_cast<uint16_t>(reference.grid.size.x))
        .word(0x00280100, bits)
        .word(0x00280101, bits)
        .word(0x00280102, static_cast<uint16_t>(bits - 1))
        .word(0x00280103, 0)
        .text(0x00282110, "CS", "00") // Lossy Image Compression
        .text(0x00620001, "CS",
              label_map                                 ? "LABELMAP"
              : options.kind == DicomLabels::fractional ? "FRACTIONAL"
                                                        : "BINARY")
        .sequence(0x00620002, segments)
        .text(0x00620013, "CS", "NO") // Segments Overlap
        .text(0x00700080, "CS", "SEGMENTATION")
        .text(0x00700081, "LO", "")
        .text(0x00700084, "PN", "")
        .sequence(0x52009229, {shared_item(reference.grid)})
        .sequence(0x52009230, frames);
    if (options.kind == DicomLabels::fractional)
        set.text(0x00620010, "CS", "OCCUPANCY").word(0x0062000e, kFull);
    if (label_map)
        set.word(0x00280120, 0); // Pixel Padding Value: the background
    return set;
}

// The samples of frames, packed as the kind stores them.
class PixelStream {
 public:
    PixelStream(io::OutputFile& file, uint16_t bits) : file_(file), bits_(bits) {}

    // `value` is 0 or 1 of bits.
    void add(uint16_t value) {
        if (bits_ == 1) {
            byte_ = static_cast<uint8_t>(byte_ | value << filled_);
            if (++filled_ < 8)
                return;
            packed_.push_back(static_cast<std::byte>(byte_));
            byte_ = 0;
            filled_ = 0;
            return;
        }
        packed_.push_back(static_cast<std::byte>(value & 0xff));
        if (bits_ == 16)
            packed_.push_back(static_cast<std::byte>(value >> 8));
    }
    Result<void> flush() {
        written_ += packed_.size();
        const Result<void> written = file_.write(packed_);
        packed_.clear();
        return written;
    }
    // Fills up to an even number of bytes.
    Result<void> finish() {
        while (filled_ > 0)
            add(0);
        if ((written_ + packed_.size()) % 2 != 0)
            packed_.push_back(std::byte{0});
        return flush();
    }

 private:
    io::OutputFile& file_;
    uint16_t bits_;
    std::vector<std::byte> packed_;
    uint64_t written_ = 0;
    uint8_t byte_ = 0;
    int filled_ = 0;
};

Result<void> write_pixels(io::OutputFile& file, const std::string& name, const Layout& layout,
                          const DicomLabelOptions& options, uint16_t bits) {
    PixelStream stream(file, bits);
    std::vector<uint16_t> samples;
    uint32_t slice = std::numeric_limits<uint32_t>::max();
    for (const SegFrame& frame : layout.frames) {
        if (options.stop.stop_requested())
            return fail("{}: writing was stopped", name);
        if (frame.slice != slice)
            (void)layout.slices.read(frame.slice, samples); // none lies outside: it was counted
        slice = frame.slice;
        const uint16_t full = options.kind == DicomLabels::fractional ? kFull : 1;
        const uint16_t label = frame.segment > 0 ? layout.labels[frame.segment - 1u] : uint16_t{0};
        for (const uint16_t sample : samples)
            stream.add(options.kind == DicomLabels::label_map ? sample
                       : sample == label                      ? full
                                                              : uint16_t{0});
        PALPATE_TRY(stream.flush());
    }
    return stream.finish();
}

} // namespace

Result<void> save_dicom_labels(const fs::path& path, const Volume& labels,
                               std::span<const LabelName> names, const DicomReference& reference,
                               const DicomLabelOptions& options) {
    const std::string name = path.string();
    PALPATE_TRY(io::check_frame_of_reference(name, options.frame_of_reference, reference.parts));
    if (reference.grid.size.x > 65535 || reference.grid.size.y > 65535)
        return fail("{}: images of {} x {} samples are larger than DICOM allows", name,
                    reference.grid.size.x, reference.grid.size.y);
    PALPATE_TRY(const Layout layout, lay_out(name, labels, reference.grid, options));
    const uint16_t bits = options.kind == DicomLabels::binary ? 1
                          : options.kind == DicomLabels::label_map && layout.labels.back() > 255
                              ? 16
                              : 8;
    const uint64_t samples =
        uint64_t{reference.grid.size.x} * reference.grid.size.y * layout.frames.size();
    const uint64_t bytes = (samples * bits + 15) / 16 * 2; // an even number
    if (bytes > kMostPixelBytes)
        return fail("{}: {} frames need {} bytes, more than the {} that a DICOM file may hold",
                    name, layout.frames.size(), bytes, kMostPixelBytes);
    const std::string instance = io::new_uid();
    const std::string head =
        io::file_start(options.kind == DicomLabels::label_map ? kLabelMapClass : kSegClass,
                       instance) +
        header_of(layout, names, reference, options, instance, bits).encoded() +
        io::long_head(0x7fe00010, bits == 16 ? "OW" : "OB", static_cast<uint32_t>(bytes));
    return write_atomically(path, [&](const fs::path& temporary) -> Result<void> {
        PALPATE_TRY(io::OutputFile file, io::OutputFile::create(temporary, name));
        PALPATE_TRY(file.write(head));
        PALPATE_TRY(write_pixels(file, name, layout, options, bits));
        return file.finish();
    });
}

} // namespace palpate
