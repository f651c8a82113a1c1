#include "engine/decode/dicom_geometry.h"

#include <algorithm>
#include <cmath>

#include "engine/decode/dicom_marks.h"

namespace palpate::io {

using gdcm::DataSet;
using gdcm::Tag;

void take_geometry(const DataSet& set, DicomFrame& frame) {
    if (const auto p = decimals(set, Tag(0x0020, 0x0032)); p.size() == 3)
        frame.position = glm::dvec3(p[0], p[1], p[2]);
    if (const auto a = decimals(set, Tag(0x0020, 0x0037)); a.size() == 6)
        frame.axes = glm::dmat2x3{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}};
    if (const auto s = decimals(set, Tag(0x0028, 0x0030)); s.size() == 2 && s[0] > 0 && s[1] > 0) {
        frame.spacing_mm = glm::dvec2(s[1], s[0]); // stored: between rows, between columns
        frame.spacing_words.clear();               // of another element
    }
    for (const Tag& tag : {Tag(0x0018, 0x0050), Tag(0x0018, 0x0088)})
        if (const auto step = decimal(set, tag); step && *step > 0)
            frame.slice_step_mm = step;
    frame.rescale.slope = decimal(set, Tag(0x0028, 0x1053)).value_or(frame.rescale.slope);
    frame.rescale.intercept = decimal(set, Tag(0x0028, 0x1052)).value_or(frame.rescale.intercept);
}

namespace {

constexpr uint16_t kNuclear = 0x0054;
const Tag kDetectorVector(kNuclear, 0x0020), kSliceVector(kNuclear, 0x0080);
const Tag kVolumePosition(0x0020, 0x930e);
const Tag kSliceLocations(0x0018, 0x2005), kFrameOffsets(0x3004, 0x000c);

struct Vector {
    Tag tag;
    const char* name;
};
// The vectors of nuclear medicine in the order of their tags, PS3.3 C.8.4.8.
const Vector kVectors[] = {
    {Tag(kNuclear, 0x0010), "EnergyWindowVector"},
    {kDetectorVector, "DetectorVector"},
    {Tag(kNuclear, 0x0030), "PhaseVector"},
    {Tag(kNuclear, 0x0050), "RotationVector"},
    {Tag(kNuclear, 0x0060), "RRIntervalVector"},
    {Tag(kNuclear, 0x0070), "TimeSlotVector"},
    {kSliceVector, "SliceVector"},
    {Tag(kNuclear, 0x0090), "AngularViewVector"},
    {Tag(kNuclear, 0x0100), "TimeSliceVector"},
};

// The elements that tell one frame from the next.
std::vector<Tag> frame_increment(const DataSet& set) {
    std::vector<Tag> tags;
    const auto words = numbers<uint16_t>(set, Tag(0x0028, 0x0009));
    for (size_t i = 0; i + 1 < words.size(); i += 2)
        tags.emplace_back(words[i], words[i + 1]);
    return tags;
}

bool is_slice_increment(const Tag& tag) {
    for (const Tag& slices : {kSliceVector, kSliceLocations, kFrameOffsets, Tag(0x0018, 0x0088),
                              Tag(0x0020, 0x0032), Tag(0x0020, 0x1041)})
        if (tag == slices)
            return true;
    return false;
}

// Binary numbers of a place: none where any is not finite, as of decimal strings.
std::vector<double> finite_numbers(const DataSet& set, const Tag& tag) {
    std::vector<double> all = numbers<double>(set, tag);
    if (!std::ranges::all_of(all, [](double number) { return std::isfinite(number); }))
        all.clear();
    return all;
}

// Position and orientation of an ultrasound volume.
void take_volume_geometry(const DataSet& groups, DicomFrame& frame) {
    if (const DicomItem group = first_item(groups, kVolumePosition))
        if (const auto p = finite_numbers(*group, Tag(0x0020, 0x9301)); p.size() == 3)
            frame.position = glm::dvec3(p[0], p[1], p[2]);
    if (const DicomItem group = first_item(groups, Tag(0x0020, 0x930f)))
        if (const auto a = finite_numbers(*group, Tag(0x0020, 0x9302)); a.size() == 6)
            frame.axes = glm::dmat2x3{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}};
}

// Takes what the functional groups of an enhanced image state.
void take_groups(const DicomItem& groups, DicomFrame& frame) {
    if (!groups)
        return;
    take_volume_geometry(*groups, frame);
    for (const Tag& tag :
         {Tag(0x0020, 0x9113), Tag(0x0020, 0x9116), Tag(0x0028, 0x9110), Tag(0x0028, 0x9145)})
        if (const DicomItem group = first_item(*groups, tag))
            take_geometry(*group, frame);
    if (const DicomItem group = first_item(*groups, Tag(0x0062, 0x000a)))
        frame.segment = word<0x0062, 0x000b>(*group).value_or(frame.segment);
    take_group_marks(*groups, frame.marks);
}

struct NamedVector {
    Vector vector;
    std::vector<uint16_t> values; // one for each frame
};

// The vectors of a nuclear image that tell its frames apart.
Result<std::vector<NamedVector>> vectors_of(const std::string& name, const DataSet& set,
                                            size_t count) {
    std::vector<Tag> increment = frame_increment(set);
    if (increment.empty())
        for (const Vector& vector : kVectors)
            if (numbers<uint16_t>(set, vector.tag).size() == count)
                increment.push_back(vector.tag);
    std::vector<NamedVector> found;
    for (const Tag& tag : increment)
        for (const Vector& vector : kVectors) {
            if (vector.tag != tag)
                continue;
            NamedVector& one = found.emplace_back(NamedVector{vector, numbers<uint16_t>(set, tag)});
            // Without its vector, the slices of an image that has nothing else are in order.
            if (one.values.empty() && (tag != kSliceVector || increment.size() == 1))
                found.pop_back();
            else if (one.values.size() != count)
                return fail("{}: its {} has {} numbers for {} frames", name, vector.name,
                            one.values.size(), count);
        }
    return found;
}

// From slice to slice along the normal; absent where it is not stated.
std::optional<double> signed_step(const std::string& name, const DataSet& set,
                                  std::vector<std::string>& warnings) {
    const std::optional<double> spacing = decimal(set, Tag(0x0018, 0x0088));
    if (spacing && *spacing != 0)
        return spacing;
    const std::optional<double> thickness = decimal(set, Tag(0x0018, 0x0050));
    if (!thickness || !(*thickness > 0))
        return {};
    warnings.push_back(
        fmt::format("{}: does not state the spacing of its slices; their thickness "
                    "of {:.6g} mm is taken",
                    name, *thickness));
    return thickness;
}

// How far each frame lies from the first along the normal, where a vector of the image states it
// (SliceLocationVector, GridFrameOffsetVector): that which the frame increment names, or either of
// an image whose increment names nothing. Empty where none does.
Result<std::vector<double>> stated_offsets_mm(const std::string& name, const DataSet& set,
                                              const std::vector<Tag>& increment, size_t count) {
    for (const Tag& tag : {kSliceLocations, kFrameOffsets}) {
        const bool is_named = std::find(increment.begin(), increment.end(), tag) != increment.end();
        std::vector<double> along = decimals(set, tag);
        if (along.empty() || !(is_named || increment.empty()))
            continue;
        if (along.size() != count)
            return fail("{}: its {} has {} numbers for {} frames", name,
                        tag == kSliceLocations ? "SliceLocationVector" : "GridFrameOffsetVector",
                        along.size(), count);
        const double first = along.front();
        for (double& mm : along)
            mm -= first;
        return along;
    }
    return std::vector<double>();
}

// Places frames of which no functional group says where they lie.
Result<void> place_classic(const std::string& name, const DataSet& set,
                           std::vector<DicomFrame>& frames, std::vector<std::string>& warnings) {
    PALPATE_TRY(const std::vector<NamedVector> vectors, vectors_of(name, set, frames.size()));
    const auto slices = std::find_if(vectors.begin(), vectors.end(), [](const NamedVector& one) {
        return one.vector.tag == kSliceVector;
    });
    const DicomItems detectors(set, Tag(kNuclear, 0x0022));
    const auto take_detector = [&](size_t index, DicomFrame& frame) {
        if (const DicomItem detector = detectors.at(index))
            take_geometry(*detector, frame);
    };
    for (DicomFrame& frame : frames)
        take_detector(0, frame);
    for (auto one = vectors.begin(); one != vectors.end(); ++one)
        for (size_t i = 0; one != slices && i < frames.size(); ++i) {
            frames[i].marks.indices.push_back({one->vector.name, one->values[i]});
            if (one->vector.tag == kDetectorVector && slices != vectors.end())
                take_detector(std::max(1u, uint32_t{one->values[i]}) - 1, frames[i]);
        }
    const std::vector<Tag> increment = frame_increment(set);
    const bool in_time =
        !increment.empty() && std::none_of(increment.begin(), increment.end(), is_slice_increment);
    PALPATE_TRY(std::vector<double> offsets_mm,
                stated_offsets_mm(name, set, increment, frames.size()));
    if ((slices != vectors.end() || !offsets_mm.empty()) && frames.size() > 1 &&
        !frames.front().position) {
        warnings.push_back(name +
                           ": does not state the position of its slices; (0, 0, 0) mm is "
                           "assumed for the first");
        for (DicomFrame& frame : frames)
            frame.position = frame.position.value_or(glm::dvec3(0));
    }
    if (frames.size() == 1 || !frames.front().position || in_time)
        return {};
    bool against_normal = !offsets_mm.empty() && offsets_mm.back() < 0;
    if (offsets_mm.empty()) {
        const std::optional<double> step = signed_step(name, set, warnings);
        if (!step)
            return {};
        against_normal = *step < 0;
        for (size_t i = 0; i < frames.size(); ++i) {
            if (slices != vectors.end() && slices->values[i] == 0)
                return fail("{}: its SliceVector holds 0 for frame {}, expected numbers from 1",
                            name, i);
            offsets_mm.push_back(*step * (slices != vectors.end() ? slices->values[i] - 1.0
                                                                  : static_cast<double>(i)));
            frames[i].slice_step_mm = std::abs(*step);
        }
    }
    for (size_t i = 0; i < frames.size(); ++i) {
        DicomFrame& frame = frames[i];
        frame.against_normal = against_normal;
        const glm::dmat2x3 axes = frame.axes.value_or(glm::dmat2x3{{1, 0, 0}, {0, 1, 0}});
        if (frame.position)
            *frame.position += offsets_mm[i] * glm::cross(axes[0], axes[1]);
    }
    return {};
}

} // namespace

Result<std::vector<DicomFrame>> frames_of(const std::string& name, const DataSet& set,
                                          const DicomFrame& plane, uint32_t count,
                                          std::vector<std::string>& warnings) {
    DicomFrame base = plane;
    base.position.reset();
    take_groups(first_item(set, Tag(0x5200, 0x9229)), base);
    const DicomItems per_frame(set, Tag(0x5200, 0x9230));
    std::vector<DicomFrame> frames(count, base);
    bool placed = false, in_volume = false;
    for (uint32_t i = 0; i < count; ++i) {
        frames[i].frame = i;
        if (count > 1)
            frames[i].instance_number = i;
        const DicomItem groups = per_frame.at(i);
        take_groups(groups, frames[i]);
        placed = placed || frames[i].position;
        in_volume = in_volume || (groups && first_item(*groups, kVolumePosition) &&
                                  !first_item(*groups, Tag(0x0020, 0x9113)));
    }
    if (in_volume)
        warnings.push_back(name + ": lies in the axes of its transducer, not of the patient");
    if (!placed) {
        for (DicomFrame& frame : frames)
            frame.position = plane.position;
        PALPATE_TRY(place_classic(name, set, frames, warnings));
    }
    return frames;
}

} // namespace palpate::io
