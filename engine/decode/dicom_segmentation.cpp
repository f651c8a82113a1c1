#include "engine/decode/dicom_segmentation.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "engine/decode/overlap_words.h"

namespace palpate::io {

namespace {

// An empty slice between two frames costs nothing in the file; this bounds what it may claim.
constexpr double kMostSlices = 4096;
constexpr double kMostSlicesPerPlace = 64;
constexpr double kOnLattice = 0.05; // of a step; what positions may be off

// The places of the frames: frame i fills slice slice_of[i] of the grid.
struct Placed {
    Grid grid;
    std::vector<uint32_t> slice_of;
};

// Whether all places are whole multiples of a step from the first.
bool on_lattice(const std::vector<double>& places, double step) {
    return std::all_of(places.begin(), places.end(), [&](double at) {
        const double k = (at - places.front()) / step;
        return std::abs(k - std::round(k)) <= kOnLattice;
    });
}

Result<Placed> place_frames(const std::string& name, const DicomFile& file,
                            std::vector<std::string>& warnings) {
    const std::vector<DicomFrame>& frames = file.frames;
    const DicomFrame& first = frames.front();
    for (const DicomFrame& frame : frames) {
        if (!frame.position || !frame.axes || !frame.spacing_mm)
            return fail("{}: does not state the {} of frame {} of its segmentation", name,
                        !frame.position ? "position"
                        : !frame.axes   ? "orientation"
                                        : "pixel spacing",
                        frame.frame);
        if (!same_plane(first, frame))
            return fail("{}: holds a segmentation with frames of several orientations ({}; {})",
                        name, plane_words(first), plane_words(frame));
    }
    const glm::dvec3 normal = glm::cross((*first.axes)[0], (*first.axes)[1]);
    if (std::abs(glm::length(normal) - 1) > 1e-3)
        return fail("{}: the image axes of its segmentation are no unit vectors at right angles",
                    name);
    std::vector<std::pair<double, const DicomFrame*>> sorted;
    for (const DicomFrame& frame : frames)
        sorted.emplace_back(glm::dot(*frame.position, normal), &frame);
    std::sort(sorted.begin(), sorted.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<double> places;
    for (const auto& [at, frame] : sorted)
        if (places.empty() || at - places.back() > kPositionRoundingMm)
            places.push_back(at);

    const double range = places.back() - places.front();
    double step = first.slice_step_mm.value_or(1.0);
    if (places.size() > 1) {
        double smallest = range;
        for (size_t k = 1; k < places.size(); ++k)
            smallest = std::min(smallest, places[k] - places[k - 1]);
        // Frames are left out where they are empty, so that the stated spacing goes first.
        if (!first.slice_step_mm || step > smallest + kPositionRoundingMm ||
            !on_lattice(places, step))
            step = smallest;
        if (!on_lattice(places, step))
            return fail(
                "{}: the frames of its segmentation lie on no even grid: from {:.5g} to {:.5g} mm "
                "along their normal with a smallest gap of {:.4g} mm",
                name, places.front(), places.back(), smallest);
    } else if (!first.slice_step_mm) {
        warnings.push_back(name + ": does not state the spacing of its slices, 1 mm is assumed");
    }
    const double slices = std::round(range / step) + 1;
    if (slices > kMostSlices && slices > kMostSlicesPerPlace * static_cast<double>(places.size()))
        return fail("{}: holds a segmentation of {:.0f} slices, of which {} have frames", name,
                    slices, places.size());
    const glm::dvec3 origin = *sorted.front().second->position;
    const glm::dvec3 step_mm =
        slices > 1 ? (*sorted.back().second->position - origin) / (slices - 1) : step * normal;
    Placed placed;
    double farthest = 0;
    for (const DicomFrame& frame : frames) {
        const double k = std::round((glm::dot(*frame.position, normal) - places.front()) / step);
        placed.slice_of.push_back(static_cast<uint32_t>(std::min(k, slices - 1)));
        farthest = std::max(farthest, glm::distance(*frame.position, origin + k * step_mm));
    }
    if (farthest > 0.1 * step + kPositionRoundingMm)
        return fail("{}: the frames of its segmentation lie up to {:.4g} mm off an even stack",
                    name, farthest);
    placed.grid.size = {first.size, static_cast<uint32_t>(slices)};
    placed.grid.world_from_index = {glm::dvec4((*first.axes)[0] * first.spacing_mm->x, 0.0),
                                    glm::dvec4((*first.axes)[1] * first.spacing_mm->y, 0.0),
                                    glm::dvec4(step_mm, 0.0), glm::dvec4(origin, 1.0)};
    return placed;
}

// The samples of frame `index` as numbers: bits, shares or labels.
void unpack_frame(const DicomFile& file, const std::vector<char>& pixels, bool bits, size_t index,
                  std::vector<uint16_t>& out) {
    const size_t start = index * out.size();
    for (size_t i = 0; i < out.size(); ++i) {
        const size_t at = start + i;
        if (bits) { // frames follow one another without padding, the lowest bit first
            out[i] = static_cast<uint8_t>(pixels[at / 8]) >> at % 8 & 1;
        } else if (bytes_per_component(file.type) == 1) {
            out[i] = static_cast<uint8_t>(pixels[at]);
        } else {
            std::memcpy(&out[i], &pixels[2 * at], 2);
        }
    }
}

// Counts the samples that two segments share, for every pair of them: a sample in three segments
// counts in three pairs. Frames come slice by slice.
class SliceOverlaps {
 public:
    SliceOverlaps(size_t samples, Overlaps& counts)
        : words_((samples + 63) / 64), counts_(&counts) {}

    // One frame: the samples of a segment in a slice, by numbers that rise within a slice.
    void begin(size_t slice, uint32_t segment) {
        if (slice_ != slice) {
            frames_.clear();
            covered_.assign(words_, 0);
        }
        slice_ = slice;
        if (frames_.empty() || frames_.back().segment != segment)
            frames_.push_back({segment, std::vector<uint64_t>(words_)});
    }
    void add(size_t sample) { frames_.back().bits[sample / 64] |= uint64_t{1} << sample % 64; }
    // After the last frame of a segment in its slice.
    void end() {
        const std::vector<uint64_t>& own = frames_.back().bits;
        bool meets = false;
        for (size_t w = 0; w < words_; ++w) {
            meets |= (own[w] & covered_[w]) != 0;
            covered_[w] |= own[w];
        }
        for (size_t f = 0; meets && f + 1 < frames_.size(); ++f) {
            uint64_t shared = 0;
            for (size_t w = 0; w < words_; ++w)
                shared += static_cast<uint64_t>(std::popcount(own[w] & frames_[f].bits[w]));
            if (shared > 0)
                (*counts_)[{frames_[f].segment, frames_.back().segment}] += shared;
        }
    }

 private:
    struct Frame {
        uint32_t segment;
        std::vector<uint64_t> bits; // by sample of the slice
    };
    size_t words_;
    Overlaps* counts_;
    size_t slice_ = std::numeric_limits<size_t>::max();
    std::vector<Frame> frames_;
    std::vector<uint64_t> covered_; // by any of the frames
};

// Paints the frames of one segment each, in rising order of segments within a slice.
template <class Label>
void paint(const DicomFile& file, const std::vector<char>& pixels, const Placed& placed,
           std::span<Label> labels, const VoxelSink& sink, Overlaps& overlaps) {
    const SegmentationKind kind = file.segmentation->kind;
    const uint32_t half = (file.segmentation->largest_fraction + 1) / 2;
    const glm::uvec3 size = placed.grid.size;
    std::vector<uint16_t> samples(size_t{size.x} * size.y);
    std::vector<uint16_t> best(kind == SegmentationKind::fractional ? labels.size() : 0);
    std::vector<size_t> order(file.frames.size());
    for (size_t i = 0; i < order.size(); ++i)
        order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return std::pair(placed.slice_of[a], file.frames[a].segment) <
               std::pair(placed.slice_of[b], file.frames[b].segment);
    });
    SliceOverlaps shared(samples.size(), overlaps);
    for (size_t k = 0; k < order.size(); ++k) {
        const size_t i = order[k];
        sink.alive();
        unpack_frame(file, pixels, file.bits_allocated == 1, i, samples);
        const size_t start = placed.slice_of[i] * samples.size();
        const uint32_t segment = file.frames[i].segment;
        if (kind != SegmentationKind::label_map)
            shared.begin(placed.slice_of[i], segment);
        for (size_t at = 0; at < samples.size(); ++at) {
            Label& label = labels[start + at];
            const uint32_t value = samples[at];
            if (kind == SegmentationKind::label_map) {
                label = static_cast<Label>(value);
                continue;
            }
            if (value < (kind == SegmentationKind::binary ? 1 : half))
                continue;
            shared.add(at);
            if (!best.empty()) {
                if (value < best[start + at])
                    continue;
                best[start + at] = static_cast<uint16_t>(value);
            }
            label = static_cast<Label>(segment);
        }
        const bool goes_on = k + 1 < order.size() &&
                             placed.slice_of[order[k + 1]] == placed.slice_of[i] &&
                             file.frames[order[k + 1]].segment == segment;
        if (kind != SegmentationKind::label_map && !goes_on)
            shared.end();
    }
}

std::string segment_words(const Segmentation& segmentation, uint32_t number) {
    for (const LabelName& segment : segmentation.segments)
        if (segment.label == number && !segment.name.empty())
            return fmt::format("{} '{}'", number, segment.name);
    return std::to_string(number);
}

void warn_of_overlaps(const std::string& name, const Segmentation& segmentation,
                      const Overlaps& overlaps, std::vector<std::string>& warnings) {
    if (overlaps.empty())
        return;
    warnings.push_back(fmt::format(
        "{}: segments overlap: {}; {}", name,
        overlap_words(overlaps,
                      [&](uint32_t number) { return segment_words(segmentation, number); }),
        segmentation.kind == SegmentationKind::fractional
            ? "the one with the larger share is kept, of equals the one with the higher number"
            : "the one with the higher number is kept"));
}

Result<void> check_segments(const std::string& name, const DicomFile& file) {
    const Segmentation& segmentation = *file.segmentation;
    std::set<uint32_t> numbers;
    for (const LabelName& segment : segmentation.segments)
        if (!numbers.insert(segment.label).second)
            return fail("{}: names segment {} twice", name, segment.label);
    const bool may_be_bits = segmentation.kind == SegmentationKind::binary;
    if ((file.bits_allocated == 1 && !may_be_bits) || bytes_per_component(file.type) > 2)
        return fail("{}: holds a segmentation of another sample size than its type allows", name);
    if (segmentation.kind != SegmentationKind::label_map)
        for (const DicomFrame& frame : file.frames)
            if (frame.segment == 0)
                return fail("{}: does not state the segment of frame {}", name, frame.frame);
    return {};
}

Result<std::vector<char>> pixels_of(const std::string& name, const DicomFile& file) {
    if (file.encapsulated) {
        if (file.bits_allocated == 1)
            return fail("{}: holds encoded bits (transfer syntax {}), which are not read", name,
                        file.syntax);
        return read_dicom_pixels(file);
    }
    if (file.syntax == "1.2.840.10008.1.2.2")
        return fail("{}: holds a big-endian segmentation, which is not read", name);
    PALPATE_TRY(std::vector<char> bytes, read_dicom_bytes(file));
    const glm::uvec2 size = file.frames.front().size;
    const uint64_t samples = uint64_t{size.x} * size.y * file.frames.size();
    const uint64_t expected =
        file.bits_allocated == 1 ? (samples + 7) / 8 : samples * bytes_per_component(file.type);
    if (bytes.size() < expected)
        return fail("{}: its segmentation has {} bytes, expected {}", name, bytes.size(), expected);
    return bytes;
}

} // namespace

Result<Decoded> decode_segmentation(const std::string& name, const DicomFile& file,
                                    VoxelSink& sink) {
    const Segmentation& segmentation = *file.segmentation;
    Decoded decoded;
    decoded.modality = "SEG";
    decoded.labels = segmentation.segments;
    decoded.frame_of_reference = file.frames.front().frame_of_reference;
    decoded.warnings = file.warnings;
    PALPATE_TRY(check_segments(name, file));
    PALPATE_TRY(const Placed placed, place_frames(name, file, decoded.warnings));
    decoded.grid = placed.grid;

    uint32_t largest =
        segmentation.kind == SegmentationKind::label_map && bytes_per_component(file.type) > 1
            ? 65535
            : 0;
    for (const DicomFrame& frame : file.frames)
        largest = std::max(largest, frame.segment);
    VoxelClaim claim;
    claim.size = placed.grid.size;
    claim.type = largest > 255 ? ComponentType::u16 : ComponentType::u8;
    claim.source_bytes = file.bytes;
    const uint64_t voxels = uint64_t{claim.size.x} * claim.size.y * claim.size.z;
    const uint64_t frames = uint64_t{claim.size.x} * claim.size.y * file.frames.size();
    // The number of slices has been checked; what is between frames is in no file.
    claim.most_expansion =
        std::max(1.0, std::ceil(static_cast<double>(voxels * bytes_per_component(claim.type)) /
                                static_cast<double>(file.bytes)));
    claim.working_bytes = 3 * file.bytes + (file.encapsulated ? 4 * frames : 0) +
                          (segmentation.kind == SegmentationKind::fractional ? 2 * voxels : 0) +
                          (uint64_t{16} << 20);
    PALPATE_TRY(const std::span<std::byte> out, sink.allocate(name, claim));
    PALPATE_TRY(const std::vector<char> pixels, pixels_of(name, file));
    Overlaps overlaps;
    if (claim.type == ComponentType::u8)
        paint<uint8_t>(file, pixels, placed, {reinterpret_cast<uint8_t*>(out.data()), out.size()},
                       sink, overlaps);
    else
        paint<uint16_t>(file, pixels, placed,
                        {reinterpret_cast<uint16_t*>(out.data()), out.size() / 2}, sink, overlaps);
    warn_of_overlaps(name, segmentation, overlaps, decoded.warnings);
    if (segmentation.kind == SegmentationKind::fractional)
        decoded.warnings.push_back(fmt::format(
            "{}: is a fractional segmentation: samples with a share of a half or more ({} of {}) "
            "carry the segment's label",
            name, (segmentation.largest_fraction + 1) / 2, segmentation.largest_fraction));
    return decoded;
}

} // namespace palpate::io
