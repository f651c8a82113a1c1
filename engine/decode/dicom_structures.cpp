#include "engine/decode/dicom_structures.h"

#include <gdcmReader.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "engine/base/option_name.h"
#include "engine/base/printable.h"
#include "engine/decode/dicom_elements.h"
#include "engine/decode/dicom_source.h"
#include "engine/decode/dicom_structure.h"
#include "engine/decode/dicom_text.h"
#include "engine/decode/overlap_words.h"
#include "engine/io/outlines.h"

namespace palpate::io {

namespace {

using gdcm::DataSet;
using gdcm::Tag;

constexpr const char* kStructureSetClass = "1.2.840.10008.5.1.4.1.1.481.3";
constexpr size_t kClassWithin = 1024;         // of a file, within which it states its class
constexpr double kMostOffPlane = 0.1;         // of the distance of slices
constexpr double kSliceBeyond = 4294967296.0; // beyond the slices of every grid
constexpr double kHalf = 0.5, kHalfRounding = 1e-6;

// One structure, in samples of the grid.
struct Structure {
    uint32_t number = 0;
    LabelName label;
    std::map<int64_t, std::vector<Outline>> slices;
};

std::string words_of(const Structure& structure) {
    return structure.label.name.empty()
               ? std::to_string(structure.number)
               : fmt::format("{} '{}'", structure.number, structure.label.name);
}

// Adds the contours of an item of the ROI Contour Sequence.
Result<void> take_contours(const std::string& name, const DataSet& set,
                           const glm::dmat4& index_from_mm, Structure& structure,
                           std::set<std::string>& not_closed) {
    const DicomItems contours(set, Tag(0x3006, 0x0040));
    for (size_t i = 0; const DicomItem contour = contours.at(i); ++i) {
        const std::string kind = text(*contour, Tag(0x3006, 0x0042));
        if (kind != "CLOSED_PLANAR" && kind != "CLOSEDPLANAR_XOR") {
            not_closed.insert(kind);
            continue;
        }
        const std::vector<double> mm = decimals(*contour, Tag(0x3006, 0x0050));
        if (mm.size() % 3 != 0 || mm.size() < 9)
            return fail(
                "{}: contour {} of structure {} has {} coordinates, expected three or more "
                "points of three",
                name, i + 1, words_of(structure), mm.size());
        Outline outline;
        double low = 0, high = 0;
        for (size_t at = 0; at < mm.size(); at += 3) {
            const glm::dvec4 index = index_from_mm * glm::dvec4(mm[at], mm[at + 1], mm[at + 2], 1);
            if (!(std::isfinite(index.x) && std::isfinite(index.y) && std::isfinite(index.z)))
                return fail(
                    "{}: contour {} of structure {} has a point ({:.4g}, {:.4g}, {:.4g} mm) too "
                    "far away to be placed among the samples of the series",
                    name, i + 1, words_of(structure), mm[at], mm[at + 1], mm[at + 2]);
            outline.emplace_back(index);
            low = at == 0 ? index.z : std::min(low, index.z);
            high = at == 0 ? index.z : std::max(high, index.z);
        }
        const double slice = std::round(0.5 * (low + high));
        if (!(std::max(high - slice, slice - low) <= kMostOffPlane))
            return fail(
                "{}: contour {} of structure {} lies between the slices of the series, or "
                "across them (from slice {:.4g} to {:.4g})",
                name, i + 1, words_of(structure), low, high);
        structure.slices[static_cast<int64_t>(std::clamp(slice, -1.0, kSliceBeyond))].push_back(
            std::move(outline));
    }
    return {};
}

Result<std::vector<Structure>> read_structures(const DecodeRequest& request, const Decoded& onto,
                                               VoxelSink& sink,
                                               std::vector<std::string>& warnings) {
    const std::string name = request.path.string();
    PALPATE_TRY(const uint64_t bytes, regular_file_bytes(request.path));
    PALPATE_TRY(const DicomStructure file, check_structure(request.path));
    PALPATE_TRY(sink.reserve(name, 8 * bytes)); // coordinates as text and as numbers
    gdcm::Reader reader;
    PALPATE_TRY(const auto stream, give_file(reader, request.path, file.deflated_at, 64 * bytes));
    if (!reader.Read())
        return fail("{}: is no DICOM file, or a damaged one", name);
    const DataSet& set = reader.GetFile().GetDataSet();
    const std::vector<std::string> sets = texts(set, Tag(0x0008, 0x0005));
    std::map<uint32_t, Structure> structures;
    const DicomItems rois(set, Tag(0x3006, 0x0020));
    for (size_t i = 0; const DicomItem roi = rois.at(i); ++i) {
        Structure structure;
        const double number = decimal(*roi, Tag(0x3006, 0x0022)).value_or(-1);
        if (!(number >= 0 && number <= 0x7fffffff))
            return fail("{}: does not state the number of structure {} of {}", name, i + 1,
                        rois.size());
        structure.number = static_cast<uint32_t>(number);
        structure.label.name = utf8_of(text(*roi, Tag(0x3006, 0x0026)), sets);
        const std::string frame = text(*roi, Tag(0x3006, 0x0024));
        if (!frame.empty() && !onto.frame_of_reference.empty() && frame != onto.frame_of_reference)
            return fail(
                "{}: structure {} lies in another frame of reference ({}) than the series "
                "({})",
                name, words_of(structure), printable(frame), printable(onto.frame_of_reference));
        if (!structures.emplace(structure.number, structure).second)
            return fail("{}: names structure {} twice", name, structure.number);
    }
    const glm::dmat4 index_from_mm = index_from_world(onto.grid);
    std::set<std::string> not_closed;
    const DicomItems all(set, Tag(0x3006, 0x0039));
    for (size_t i = 0; const DicomItem item = all.at(i); ++i) {
        sink.alive();
        const auto found = structures.find(
            static_cast<uint32_t>(decimal(*item, Tag(0x3006, 0x0084)).value_or(0xffffffff)));
        if (found == structures.end())
            return fail("{}: has contours of a structure that it does not name", name);
        if (const auto rgb = decimals(*item, Tag(0x3006, 0x002a)); rgb.size() == 3)
            found->second.label.color =
                glm::clamp(glm::dvec3(rgb[0], rgb[1], rgb[2]) / 255.0, 0.0, 1.0);
        PALPATE_TRY(take_contours(name, *item, index_from_mm, found->second, not_closed));
    }
    for (const std::string& kind : not_closed)
        warnings.push_back(fmt::format("{}: contours of type '{}' enclose nothing and are left out",
                                       name, printable(kind)));
    std::vector<Structure> list;
    for (auto& [number, structure] : structures)
        list.push_back(std::move(structure));
    return list;
}

void number_labels(const std::string& name, std::vector<Structure>& structures,
                   std::vector<std::string>& warnings) {
    if (structures.empty())
        return;
    const bool fit = structures.front().number > 0 && structures.back().number <= 65535;
    for (size_t i = 0; i < structures.size(); ++i)
        structures[i].label.label = fit ? structures[i].number : static_cast<uint32_t>(i + 1);
    if (!fit)
        warnings.push_back(
            fmt::format("{}: numbers of structures are no labels (1 .. 65535), so that they are "
                        "counted from 1",
                        name));
}

// Whether the centre of a sample lies within, by the rule that of two areas which share an edge one
// has it. For samples that are half covered, as they are along contours through their centres.
bool holds_center(const std::vector<Outline>& outlines, glm::dvec2 at) {
    bool inside = false;
    for (const Outline& outline : outlines)
        inside ^= io::contains(outline, at);
    return inside;
}

// Calls fill(x, y) for the samples of a slice that belong to a structure.
template <class Fill>
void fill_samples(std::vector<Outline> outlines, glm::ivec2 size, const Fill& fill) {
    glm::dvec2 low(size), high(-1);
    for (const Outline& outline : outlines)
        for (const glm::dvec2 at : outline) {
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
    const glm::ivec2 first(glm::clamp(glm::floor(low), glm::dvec2(0), glm::dvec2(size)));
    const glm::ivec2 last(glm::clamp(glm::ceil(high), glm::dvec2(-1), glm::dvec2(size - 1)));
    const glm::ivec2 box = last - first + 1;
    if (box.x <= 0 || box.y <= 0)
        return;
    for (Outline& outline : outlines)
        for (glm::dvec2& at : outline)
            at -= glm::dvec2(first);
    const std::vector<float> covered = covered_areas(outlines, glm::uvec2(box));
    for (int y = 0; y < box.y; ++y)
        for (int x = 0; x < box.x; ++x) {
            const double area =
                covered[static_cast<size_t>(y) * static_cast<size_t>(box.x) + size_t(x)];
            if (area > kHalf + kHalfRounding ||
                (area > kHalf - kHalfRounding && holds_center(outlines, {x, y})))
                fill(first.x + x, first.y + y);
        }
}

template <class Label>
void paint(const std::vector<Structure>& structures, const Grid& grid, std::span<Label> labels,
           const VoxelSink& sink, Overlaps& overlaps, size_t& beyond) {
    for (const Structure& structure : structures)
        for (const auto& [slice, outlines] : structure.slices) {
            sink.alive();
            if (slice < 0 || slice >= int64_t{grid.size.z}) {
                beyond += outlines.size();
                continue;
            }
            const size_t start = static_cast<size_t>(slice) * grid.size.x * grid.size.y;
            fill_samples(outlines, glm::ivec2(glm::uvec2(grid.size)), [&](int x, int y) {
                Label& label = labels[start + static_cast<size_t>(y) * grid.size.x + size_t(x)];
                if (label != 0)
                    ++overlaps[{label, structure.label.label}];
                label = static_cast<Label>(structure.label.label);
            });
        }
}

// The class that a little-endian file states near its beginning: in the meta header (0002,0002),
// or, without one, in the data set (0008,0016). Empty where it states none.
std::string_view class_of(std::string_view head) {
    const auto number = [&](size_t at, size_t bytes) {
        uint32_t value = 0;
        for (size_t i = 0; i < bytes; ++i)
            value |= uint32_t{static_cast<uint8_t>(head[at + i])} << 8 * i;
        return value;
    };
    const auto is_letter = [](char c) { return c >= 'A' && c <= 'Z'; };
    size_t at = head.size() > 132 && head.substr(128, 4) == "DICM" ? 132 : 0;
    while (at + 12 <= head.size()) {
        const uint32_t tag = number(at, 2) << 16 | number(at + 2, 2);
        const std::string_view kind = head.substr(at + 4, 2);
        size_t value = at + 8, bytes = 0;
        if (!is_letter(kind[0]) || !is_letter(kind[1])) {
            bytes = number(at + 4, 4); // implicit
        } else if (std::string_view("OB OW SQ UN UT").find(kind) != std::string_view::npos) {
            value = at + 12;
            bytes = number(at + 8, 4);
        } else {
            bytes = number(at + 6, 2);
        }
        if (tag == 0x00020002 || tag == 0x00080016) {
            const std::string_view uid = head.substr(value, bytes);
            return uid.substr(0, uid.find_last_not_of(std::string_view(" \0", 2)) + 1);
        }
        if (tag > 0x00080016)
            break;
        at = value + bytes;
    }
    return {};
}

} // namespace

bool is_structure_set(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::string head(kClassWithin, '\0');
    in.read(head.data(), kClassWithin);
    head.resize(static_cast<size_t>(in.gcount()));
    return class_of(head) == kStructureSetClass;
}

Result<Decoded> decode_structures(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    if (request.onto.empty())
        return fail(
            "{}: is a DICOM radiotherapy structure set (RTSTRUCT), expected a DICOM image, or the "
            "series that its contours lie on ({})",
            name, Option{"reference"});
    DecodeRequest series{request.onto, {}, request.onto_series};
    series.reference = true;
    PALPATE_TRY(Decoded decoded, decode_any(series, sink));
    if (!decoded.reference)
        return fail("{}: expected the series of DICOM images that the contours of {} lie on",
                    request.onto.string(), name);
    decoded.reference.reset();
    decoded.series.clear();
    decoded.inverted = false;
    decoded.modality = kStructureSet;
    PALPATE_TRY(std::vector<Structure> structures,
                read_structures(request, decoded, sink, decoded.warnings));
    number_labels(name, structures, decoded.warnings);
    uint32_t largest = 0;
    for (const Structure& structure : structures) {
        largest = std::max(largest, structure.label.label);
        decoded.labels.push_back(structure.label);
    }
    VoxelClaim claim;
    claim.size = decoded.grid.size;
    claim.type = largest > 255 ? ComponentType::u16 : ComponentType::u8;
    PALPATE_TRY(claim.source_bytes, regular_file_bytes(request.path));
    // The series has been checked for what its images hold.
    claim.most_expansion = std::ceil(static_cast<double>(sample_count(decoded.grid)) * 2.0 /
                                     static_cast<double>(claim.source_bytes)) +
                           1.0;
    claim.working_bytes = 32 * uint64_t{claim.size.x} * claim.size.y;
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    Overlaps overlaps;
    size_t beyond = 0;
    visit_component(claim.type, [&](auto t) {
        using Label = decltype(t);
        if constexpr (std::is_unsigned_v<Label> && sizeof(Label) <= 2)
            paint(structures, decoded.grid,
                  std::span(reinterpret_cast<Label*>(voxels.data()), voxels.size() / sizeof(Label)),
                  sink, overlaps, beyond);
    });
    if (beyond > 0)
        decoded.warnings.push_back(fmt::format(
            "{}: {} contours lie beyond the slices of the series and are left out", name, beyond));
    if (!overlaps.empty())
        decoded.warnings.push_back(
            fmt::format("{}: structures overlap: {}; the one with the higher number is kept", name,
                        overlap_words(overlaps, [&](uint32_t label) {
                            for (const Structure& structure : structures)
                                if (structure.label.label == label)
                                    return words_of(structure);
                            return std::to_string(label);
                        })));
    return decoded;
}

} // namespace palpate::io
