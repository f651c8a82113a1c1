#include "engine/io/dicom_structures_write.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/base/file.h"
#include "engine/io/dicom_modules.h"
#include "engine/io/label_slices.h"
#include "engine/io/outlines.h"
#include "engine/io/output_file.h"
#include "engine/scene/scene.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

using io::DicomSet;

constexpr const char* kStructureClass = "1.2.840.10008.5.1.4.1.1.481.3";
constexpr const char* kStudyClass = "1.2.840.10008.3.1.2.3.1"; // retired, as the standard asks

// The contours of one label.
struct Region {
    uint16_t label;
    std::vector<DicomSet> contours;
};

DicomSet contour_item(const io::Outline& outline, uint32_t slice, size_t number,
                      const DicomReference& reference) {
    std::vector<double> points;
    for (const glm::dvec2 at : outline) {
        const glm::dvec3 world = world_point(reference.grid, {at.x, at.y, slice});
        points.insert(points.end(), {world.x, world.y, world.z});
    }
    DicomSet item;
    if (const DicomSlice& image = reference.parts.slices[slice]; io::has_image(image))
        item.sequence(0x30060016, {io::instance_item(image)}); // Contour Image Sequence
    return item.text(0x30060042, "CS", "CLOSED_PLANAR")
        .text(0x30060046, "IS",
              std::to_string(outline.size())) // Number of Contour Points
        .text(0x30060048, "IS", std::to_string(number))
        .decimals(0x30060050, points); // Contour Data
}

Result<std::vector<Region>> regions_of(const std::string& name, const Volume& labels,
                                       const DicomReference& reference,
                                       const DicomLabelOptions& options) {
    Result<io::LabelSlices> slices = io::LabelSlices::make(labels, reference.grid);
    if (!slices)
        return fail("{}: {}", name, slices.error().message);
    std::map<uint16_t, Region> regions;
    PALPATE_TRY(slices->visit(
        name, options.stop,
        [&](uint32_t k, std::span<const uint16_t> samples, const std::vector<uint16_t>& found) {
            for (const uint16_t label : found) {
                Region& region = regions.try_emplace(label, Region{label, {}}).first->second;
                for (const io::Outline& outline :
                     io::outlines_of(samples, glm::uvec2(reference.grid.size), label))
                    region.contours.push_back(
                        contour_item(outline, k, region.contours.size() + 1, reference));
            }
        }));
    std::vector<Region> all;
    for (auto& [label, region] : regions)
        all.push_back(std::move(region));
    return all;
}

// The images that contours refer to.
DicomSet frame_of_reference_item(const DicomParts& parts) {
    std::vector<DicomSet> images;
    for (const DicomSlice& slice : parts.slices)
        if (io::has_image(slice))
            images.push_back(io::instance_item(slice));
    const DicomSet series = DicomSet()
                                .text(0x0020000e, "UI", io::allowed_uid(parts.series_uid))
                                .sequence(0x30060016, images);
    const DicomSet study = DicomSet()
                               .text(0x00081150, "UI", kStudyClass)
                               .text(0x00081155, "UI", io::allowed_uid(parts.study_uid))
                               .sequence(0x30060014, {series}); // RT Referenced Series
    return DicomSet()
        .text(0x00200052, "UI", io::allowed_uid(parts.frame_of_reference_uid))
        .sequence(0x30060012, {study}); // RT Referenced Study
}

DicomSet structures_of(std::span<const Region> regions, std::span<const LabelName> names,
                       const DicomReference& reference, const DicomLabelOptions& options,
                       const std::string& instance) {
    DicomSet set = io::object_of(
        reference.parts, {kStructureClass, instance, "RTSTRUCT",
                          options.description.empty() ? "Structures" : options.description});
    std::vector<DicomSet> rois, contours, observations;
    for (const Region& region : regions) {
        const io::NamedSegment segment = io::named_segment(region.label, names, options.codes);
        const std::string number = std::to_string(region.label);
        const auto byte = [](double share) {
            return std::lround(255 * std::clamp(share, 0.0, 1.0));
        };
        rois.push_back(
            DicomSet()
                .text(0x30060022, "IS", number)
                .text(0x30060024, "UI", io::allowed_uid(reference.parts.frame_of_reference_uid))
                .text(0x30060026, "LO", segment.name)
                .text(0x30060036, "CS",
                      "SEMIAUTOMATIC")); // ROI Generation Algorithm
        contours.push_back(DicomSet()
                               .text(0x3006002a, "IS",
                                     fmt::format("{}\\{}\\{}", byte(segment.color.x),
                                                 byte(segment.color.y), byte(segment.color.z)))
                               .sequence(0x30060040, region.contours)
                               .text(0x30060084, "IS", number));
        observations.push_back(DicomSet()
                                   .text(0x30060082, "IS", number)
                                   .text(0x30060084, "IS", number)
                                   .sequence(0x30060086, {io::code_item(segment.code.type)})
                                   .text(0x300600a4, "CS", "")   // RT ROI Interpreted Type
                                   .text(0x300600a6, "PN", "")); // ROI Interpreter
    }
    const io::DicomMoment now = io::moment_now();
    return set
        .text(0x00081070, "PN", "")  // Operators' Name
        .text(0x00200013, "IS", "1") // Instance Number
        .text(0x30060002, "SH", "Palpate")
        .text(0x30060008, "DA", now.date)
        .text(0x30060009, "TM", now.time)
        .sequence(0x30060010, {frame_of_reference_item(reference.parts)})
        .sequence(0x30060020, rois)
        .sequence(0x30060039, contours)
        .sequence(0x30060080, observations)
        .text(0x300e0002, "CS", "UNAPPROVED");
}

} // namespace

Result<void> save_dicom_structures(const fs::path& path, const Volume& labels,
                                   std::span<const LabelName> names,
                                   const DicomReference& reference,
                                   const DicomLabelOptions& options) {
    const std::string name = path.string();
    PALPATE_TRY(io::check_frame_of_reference(name, options.frame_of_reference, reference.parts));
    PALPATE_TRY(const std::vector<Region> regions, regions_of(name, labels, reference, options));
    const std::string instance = io::new_uid();
    // A contour of some thousand points is longer than explicit representations
    // allow.
    constexpr auto kEncoding = io::DicomEncoding::implicit_little;
    const std::string bytes =
        io::file_start(kStructureClass, instance, kEncoding) +
        structures_of(regions, names, reference, options, instance).encoded(kEncoding);
    return write_atomically(path, [&](const fs::path& temporary) -> Result<void> {
        PALPATE_TRY(io::OutputFile file, io::OutputFile::create(temporary, name));
        PALPATE_TRY(file.write(bytes));
        return file.finish();
    });
}

} // namespace palpate
