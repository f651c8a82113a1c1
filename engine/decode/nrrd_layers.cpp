#include "engine/decode/nrrd_layers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <type_traits>

#include "engine/decode/overlap_words.h"

namespace palpate::io {

namespace {

constexpr uint64_t kMostLayers = 65535;
constexpr uint64_t kLayerBlockBytes = 1 << 20;

// The place of one segment, and what it becomes.
struct PlacedSegment {
    uint64_t layer = 0;
    uint32_t value = 0;
    LabelName label;
    uint64_t samples = 0; // of the segment itself, before others cover it
};

Result<std::vector<PlacedSegment>> place_segments(const std::string& name, const NrrdHeader& header,
                                                  uint64_t layers,
                                                  std::vector<std::string>& notes) {
    std::vector<PlacedSegment> placed;
    std::set<std::pair<uint64_t, uint32_t>> taken;
    std::set<uint32_t> values;
    for (const NrrdHeader::Segment& segment : header.segments) {
        const int64_t layer = segment.layer.value_or(segment.number);
        if (layer < 0 || static_cast<uint64_t>(layer) >= layers)
            return fail("{}: expected layers 0 .. {}, found {} of segment {} '{}'", name,
                        layers - 1, layer, segment.number, segment.label.name.substr(0, 60));
        const uint32_t value = std::max(segment.label.label, 1u);
        if (!taken.insert({static_cast<uint64_t>(layer), value}).second)
            return fail(
                "{}: expected segments of their own values, found several of value {} in "
                "layer {}",
                name, value, layer);
        values.insert(value);
        placed.push_back({static_cast<uint64_t>(layer), value, segment.label, 0});
    }
    if (placed.size() > kMostLayers)
        return fail("{}: expected at most {} segments, found {}", name, kMostLayers, placed.size());
    const bool keep = values.size() == placed.size();
    for (size_t i = 0; i < placed.size(); ++i)
        placed[i].label.label = keep ? placed[i].value : static_cast<uint32_t>(i + 1);
    if (!keep)
        notes.push_back(fmt::format(
            "{}: its layers use the same values, so its labels are the numbers of segments", name));
    std::sort(placed.begin(), placed.end(), [](const PlacedSegment& a, const PlacedSegment& b) {
        return a.label.label < b.label.label;
    });
    return placed;
}

class Painter {
 public:
    Painter(std::vector<PlacedSegment>& segments, uint64_t layers)
        : segments_(segments), of_(layers) {
        for (size_t i = 0; i < segments.size(); ++i) {
            std::vector<uint32_t>& of_layer = of_[segments[i].layer];
            of_layer.resize(std::max<size_t>(of_layer.size(), segments[i].value + 1), 0);
            of_layer[segments[i].value] = static_cast<uint32_t>(i + 1);
        }
    }

    // The label of one sample, from its values in all layers, which lie `stride` apart.
    template <class T>
    uint32_t label(const T* values, uint64_t stride) {
        found_.clear();
        for (size_t layer = 0; layer < of_.size(); ++layer) {
            const T value = values[layer * stride];
            if (value == T(0))
                continue;
            const std::vector<uint32_t>& of_layer = of_[layer];
            const bool is_index =
                value > T(0) && static_cast<double>(value) < double(of_layer.size());
            const uint32_t segment = is_index ? of_layer[static_cast<size_t>(value)] : 0;
            if (segment == 0 || static_cast<T>(static_cast<size_t>(value)) != value)
                ++unnamed_;
            else
                found_.push_back(segment - 1);
        }
        if (found_.empty())
            return 0;
        for (const uint32_t segment : found_)
            ++segments_[segment].samples;
        if (found_.size() > 1) {
            std::sort(found_.begin(), found_.end());
            for (size_t i = 0; i < found_.size(); ++i)
                for (size_t j = i + 1; j < found_.size(); ++j)
                    ++overlaps_[{found_[i], found_[j]}];
        }
        return segments_[found_.back()].label.label;
    }

    void warn(const std::string& name, std::vector<std::string>& warnings) const {
        if (unnamed_ > 0)
            warnings.push_back(fmt::format(
                "{}: {} samples of its layers have values that no segment names; they are left out",
                name, unnamed_));
        if (overlaps_.empty())
            return;
        warnings.push_back(fmt::format(
            "{}: segments overlap: {}; the one with the higher number is kept", name,
            overlap_words(overlaps_, [&](uint32_t segment) { return words(segment); })));
    }

 private:
    std::string words(uint32_t segment) const {
        const PlacedSegment& placed = segments_[segment];
        return fmt::format(
            "{}{} ({} samples)", placed.label.label,
            placed.label.name.empty() ? "" : fmt::format(" '{}'", placed.label.name.substr(0, 60)),
            placed.samples);
    }

    std::vector<PlacedSegment>& segments_;
    std::vector<std::vector<uint32_t>> of_; // layer and value: index of a segment + 1
    std::vector<uint32_t> found_;
    Overlaps overlaps_;
    uint64_t unnamed_ = 0;
};

template <class Label>
Result<void> paint(const Payload& payload, std::span<Label> labels, const VoxelSink& sink,
                   Painter& painter) {
    const uint64_t run = payload.run == 0 ? labels.size() : payload.run;
    const uint64_t group = run * payload.frames * bytes_per_component(payload.type);
    const uint64_t groups_in_block = std::max<uint64_t>(1, kLayerBlockBytes / group);
    std::vector<uint64_t> block((groups_in_block * group + 7) / 8); // aligned for every type
    PALPATE_TRY(VoxelStream stream, VoxelStream::open(payload));
    for (size_t at = 0; at < labels.size();) {
        sink.alive();
        const uint64_t groups = std::min(groups_in_block, (labels.size() - at) / run);
        PALPATE_TRY(stream.read({reinterpret_cast<std::byte*>(block.data()), groups * group}));
        visit_component(payload.type, [&](auto t) {
            using T = decltype(t);
            const T* values = reinterpret_cast<const T*>(block.data());
            for (uint64_t g = 0; g < groups; ++g, values += run * payload.frames)
                for (uint64_t i = 0; i < run; ++i)
                    labels[at++] = static_cast<Label>(painter.label(values + i, run));
        });
    }
    std::vector<std::string> ignored; // bytes that follow are no part of the segmentation
    return stream.finish(ignored);
}

} // namespace

bool has_layers(const NrrdHeader& header) {
    return !header.segments.empty() &&
           std::any_of(header.axes.begin(), header.axes.end(),
                       [](const NrrdHeader::Axis& axis) { return axis.is_list; });
}

std::vector<LabelName> names_of_labels(const NrrdHeader& header) {
    std::vector<LabelName> labels;
    for (const NrrdHeader::Segment& segment : header.segments) {
        LabelName label = segment.label;
        if (label.label == 0 && header.segments.size() == 1)
            label.label = 1; // of old files
        if (label.label > 0)
            labels.push_back(std::move(label));
    }
    return labels;
}

Result<void> read_layers(const std::string& name, const NrrdHeader& header, const Payload& payload,
                         VoxelSink& sink, Decoded& decoded) {
    if (payload.frames > kMostLayers)
        return fail("{}: expected at most {} layers of a segmentation, found {}", name, kMostLayers,
                    payload.frames);
    if (payload.components > 1)
        return fail("{}: expected one value a layer and sample, found {}", name,
                    payload.components);
    PALPATE_TRY(std::vector<PlacedSegment> segments,
                place_segments(name, header, payload.frames, decoded.notes));
    VoxelClaim claim;
    claim.size = payload.size;
    PALPATE_TRY(claim.source_bytes, VoxelStream::source_bytes(payload));
    claim.type = segments.back().label.label > 255 ? ComponentType::u16 : ComponentType::u8;
    const uint64_t samples = uint64_t{claim.size.x} * claim.size.y * claim.size.z;
    const uint64_t in_bytes = samples * payload.frames * bytes_per_component(payload.type);
    // The stream has been held against the file; labels may take more bytes than values.
    claim.most_expansion =
        std::max(1.0, std::ceil(static_cast<double>(samples * bytes_per_component(claim.type)) /
                                static_cast<double>(std::max<uint64_t>(claim.source_bytes, 1))));
    claim.working_bytes = 2 * kLayerBlockBytes + (payload.run == 1 ? 0 : in_bytes) +
                          (payload.encoding == Encoding::ascii ? claim.source_bytes : 0);
    PALPATE_TRY(const std::span<std::byte> out, sink.allocate(name, claim));
    Painter painter(segments, payload.frames);
    if (claim.type == ComponentType::u8)
        PALPATE_TRY(paint<uint8_t>(payload, {reinterpret_cast<uint8_t*>(out.data()), samples}, sink,
                                   painter));
    else
        PALPATE_TRY(paint<uint16_t>(payload, {reinterpret_cast<uint16_t*>(out.data()), samples},
                                    sink, painter));
    painter.warn(name, decoded.warnings);
    for (const PlacedSegment& placed : segments)
        decoded.labels.push_back(placed.label);
    return {};
}

} // namespace palpate::io
