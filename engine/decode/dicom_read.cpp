#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <set>

#include "engine/base/option_name.h"
#include "engine/decode/dicom_codestream.h"
#include "engine/decode/dicom_fit.h"
#include "engine/decode/dicom_reference.h"
#include "engine/decode/dicom_resample.h"
#include "engine/decode/dicom_segmentation.h"
#include "engine/decode/dicom_structures.h"
#include "engine/decode/dicom_walk.h"
#include "engine/decode/formats.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

using Files = std::map<fs::path, DicomFile>;
using Failures =
    std::map<fs::path, std::string>; // the files whose pixels no codec decodes, and why

// If this many files fail and none is read, the others are not tried.
constexpr size_t kMostFailuresInARow = 8;

// One type that holds every file's: its own where they agree, else f64, which also holds NaN for
// missing slices. Padding becomes NaN later, in the parent (StoredRange).
ComponentType common_type(const Files& files, const DicomStack& stack) {
    if (stack.resampled)
        return ComponentType::f32;
    const ComponentType first = files.at(stack.frames.front().file).type;
    for (const DicomFrame& frame : stack.frames)
        if (frame.file.empty() || files.at(frame.file).type != first)
            return ComponentType::f64;
    return first;
}

void copy_frame(const DicomFile& file, std::span<const char> pixels, uint32_t frame,
                ComponentType type, std::span<std::byte> out) {
    if (file.type == type) {
        std::memcpy(out.data(), pixels.data() + frame * out.size(), out.size());
        return;
    }
    visit_component(file.type, [&](auto t) {
        using T = decltype(t);
        const size_t count = out.size() / sizeof(double);
        const T* from = reinterpret_cast<const T*>(pixels.data()) + frame * count;
        std::copy(from, from + count, reinterpret_cast<double*>(out.data()));
    });
}

// Leaves the slices of files that fail as they are.
Failures copy_pixels(const Files& files, const DicomStack& stack, ComponentType type,
                     std::span<std::byte> voxels, const VoxelSink& sink) {
    Failures failures;
    bool any_read = false;
    const size_t slice_bytes = voxels.size() / stack.frames.size();
    // A multi-frame file is decoded once for all its frames.
    std::map<fs::path, std::vector<size_t>> slices_of;
    for (size_t z = 0; z < stack.frames.size(); ++z)
        slices_of[stack.frames[z].file].push_back(z);
    for (const auto& [path, slices] : slices_of) {
        if (path.empty()) { // missing; the type is f64
            for (const size_t z : slices)
                std::fill_n(reinterpret_cast<double*>(voxels.data() + z * slice_bytes),
                            slice_bytes / sizeof(double), std::nan(""));
            continue;
        }
        sink.alive(path);
        const DicomFile& file = files.at(path);
        const Result<std::vector<char>> pixels = read_dicom_pixels(file);
        if (!pixels) {
            failures.emplace(path, pixels.error().message);
            if (!any_read && failures.size() == kMostFailuresInARow)
                break;
            continue;
        }
        any_read = true;
        for (const size_t z : slices)
            copy_frame(file, *pixels, stack.frames[z].frame, type,
                       voxels.subspan(z * slice_bytes, slice_bytes));
    }
    return failures;
}

// Ends at the first file that fails.
Failures resample_pixels(const Files& files, const DicomStack& stack, std::span<std::byte> voxels,
                         const VoxelSink& sink) {
    Failures failures;
    fs::path last, decoded;
    std::vector<char> pixels; // of that file, which may hold several frames
    const auto values_of = [&](const DicomFrame& frame) -> Result<std::vector<double>> {
        sink.alive(frame.file);
        last = frame.file;
        const DicomFile& file = files.at(frame.file);
        if (frame.file != decoded) {
            PALPATE_TRY(pixels, read_dicom_pixels(file));
            decoded = frame.file;
        }
        std::vector<double> values(size_t{frame.size.x} * frame.size.y);
        copy_frame(file, pixels, frame.frame, ComponentType::f64,
                   std::as_writable_bytes(std::span(values)));
        for (double& value : values)
            value = frame.padding.holds(value)
                        ? std::nan("")
                        : frame.rescale.slope * value + frame.rescale.intercept;
        return values;
    };
    const Result<void> made = resample_stack(
        stack, values_of, {reinterpret_cast<float*>(voxels.data()), voxels.size() / sizeof(float)});
    if (!made)
        failures.emplace(last, made.error().message);
    return failures;
}

// Tells whether the samples of two images are the same, value by value. The file that it read last
// for either of the two is kept.
class SampleComparison {
 public:
    SampleComparison(const Files& files, const VoxelSink& sink) : files_(files), sink_(sink) {}

    bool operator()(const DicomFrame& a, const DicomFrame& b) {
        return a.size == b.size && a.rescale == b.rescale && a.inverted == b.inverted &&
               values_of(a, kept_[0]) && values_of(b, kept_[1]) &&
               std::memcmp(kept_[0].values.data(), kept_[1].values.data(),
                           kept_[0].values.size() * sizeof(double)) == 0;
    }

 private:
    struct Kept {
        fs::path file;
        std::vector<char> pixels;
        std::vector<double> values; // of one frame
    };

    // False where its codec does not decode the file.
    bool values_of(const DicomFrame& frame, Kept& kept) {
        const DicomFile& file = files_.at(frame.file);
        if (kept.file != frame.file) {
            sink_.alive(frame.file);
            Result<std::vector<char>> pixels = read_dicom_pixels(file);
            sink_.alive();
            if (!pixels)
                return false;
            kept.file = frame.file;
            kept.pixels = std::move(*pixels);
        }
        kept.values.resize(size_t{frame.size.x} * frame.size.y);
        copy_frame(file, kept.pixels, frame.frame, ComponentType::f64,
                   std::as_writable_bytes(std::span(kept.values)));
        return true;
    }

    const Files& files_;
    const VoxelSink& sink_;
    std::array<Kept, 2> kept_;
};

// The images of the chosen series that have another size or orientation.
std::vector<DicomFrame> other_planes(const std::vector<DicomSeries>& all, size_t chosen) {
    std::vector<DicomFrame> others;
    for (size_t i = 0; i < all.size(); ++i)
        if (i != chosen && all[i].uid == all[chosen].uid &&
            all[i].frames.front().object == DicomObject::image)
            others.insert(others.end(), all[i].frames.begin(), all[i].frames.end());
    return others;
}

// Warns where there are such images.
void warn_of_other_planes(const std::string& name, const std::vector<DicomSeries>& all,
                          size_t chosen, std::vector<std::string>& warnings) {
    std::string others;
    size_t left_out = 0, images = all[chosen].frames.size();
    for (size_t i = 0; i < all.size(); ++i) {
        const DicomFrame& first = all[i].frames.front();
        if (i == chosen || all[i].uid != all[chosen].uid || first.object != DicomObject::image)
            continue;
        left_out += all[i].frames.size();
        others += fmt::format(
            "{}{} like {} ({}: {}; {} {} reads {})", others.empty() ? "" : ", ",
            all[i].frames.size(), leaf(first), difference_words(first, all[chosen].frames.front()),
            plane_words(first), Option{"series"}, i + 1, all[i].frames.size() == 1 ? "it" : "them");
    }
    images += left_out;
    if (left_out > 0)
        warnings.push_back(fmt::format(
            "{}: the series mixes sizes or orientations: {} images like {} ({}) are read; {} of "
            "{} images are left out: {}",
            name, all[chosen].frames.size(), leaf(all[chosen].frames.front()),
            plane_words(all[chosen].frames.front()), left_out, images, others));
}

// Sets files of a series aside where others are left.
bool set_aside(DicomFiles& found, DicomSeries& series, const Failures& failures) {
    const auto failed = [&](const DicomFrame& frame) { return failures.count(frame.file) > 0; };
    if (std::all_of(series.frames.begin(), series.frames.end(), failed))
        return false;
    std::erase_if(series.frames, failed);
    for (const auto& [path, why] : failures)
        set_aside(found, path, why);
    return true;
}

// Those whose encoded pixels are damaged.
void set_damaged_aside(DicomFiles& found, DicomSeries& series, const VoxelSink& sink) {
    std::set<fs::path> paths;
    for (const DicomFrame& frame : series.frames)
        paths.insert(frame.file);
    if (paths.size() < 2)
        return;
    Failures damaged;
    for (const fs::path& path : paths) {
        sink.alive(path);
        if (const Result<uint32_t> checked = check_codestreams(found.files.at(path)); !checked)
            damaged.emplace(path, checked.error().message);
    }
    set_aside(found, series, damaged);
}

// The claim for a stack's voxels; takes the slices' rescales and the files' warnings over.
VoxelClaim claim_of(const Files& files, const DicomStack& stack, Decoded& decoded) {
    VoxelClaim claim;
    claim.size = stack.grid.size;
    claim.type = common_type(files, stack);
    uint64_t largest = 0;
    std::set<fs::path> counted;
    for (const DicomFrame& frame : stack.frames) {
        if (!stack.resampled) { // else it is done in values
            decoded.rescale.push_back(frame.rescale);
            decoded.padding.push_back(frame.padding);
        }
        if (frame.file.empty() || !counted.insert(frame.file).second)
            continue;
        const DicomFile& file = files.at(frame.file);
        decoded.warnings.insert(decoded.warnings.end(), file.warnings.begin(), file.warnings.end());
        claim.source_bytes += file.bytes;
        claim.most_expansion = std::max(claim.most_expansion, file.most_expansion);
        // GDCM holds the encoded and the decoded pixels of a file, and copies them out.
        const uint64_t samples = uint64_t{frame.size.x} * frame.size.y * file.frames.size();
        largest = std::max(largest, 3 * file.bytes + 4 * samples * bytes_per_component(file.type));
    }
    if (claim.type == ComponentType::f64 && claim.most_expansion == kRawExpansion)
        claim.most_expansion = 8.0; // widened from as little as one byte
    // Slices that are missing, or made between others, are in no file; make_stack bounds them.
    const double made = static_cast<double>(sample_count(stack.grid)) /
                        (static_cast<double>(counted.size()) * stack.frames.front().size.x *
                         stack.frames.front().size.y);
    if (stack.resampled)
        largest += 8 * sizeof(double) * uint64_t{claim.size.x} * claim.size.y;
    if (stack.resampled || made > 1)
        claim.most_expansion *= std::max(1.0, made) * 8.0;
    claim.working_bytes = largest;
    if (std::all_of(decoded.padding.begin(), decoded.padding.end(),
                    [](const StoredRange& padding) { return padding == StoredRange{}; }))
        decoded.padding.clear();
    return claim;
}

// The image in the middle of those that say where they lie; of none, that in the middle of all.
DicomFrame middle_of(std::vector<DicomFrame> frames) {
    const auto placed = std::partition(frames.begin(), frames.end(), [](const DicomFrame& frame) {
        return frame.position && frame.axes;
    });
    const auto end = placed == frames.begin() ? frames.end() : placed;
    const auto middle = frames.begin() + (end - frames.begin()) / 2;
    if (placed != frames.begin()) {
        const glm::dmat2x3 axes = *frames.front().axes; // of all: they are of one plane
        const glm::dvec3 normal = glm::cross(axes[0], axes[1]);
        std::nth_element(frames.begin(), middle, end,
                         [&](const DicomFrame& a, const DicomFrame& b) {
                             return glm::dot(*a.position, normal) < glm::dot(*b.position, normal);
                         });
    }
    return std::move(*middle);
}

} // namespace

Result<Decoded> decode_dicom(const DecodeRequest& request, VoxelSink& sink) {
    if (is_structure_set(request.path))
        return decode_structures(request, sink);
    const std::string name = request.path.string();
    Result<DicomFiles> found = read_dicom_headers(request, sink);
    sink.alive(); // in no file
    if (!found)
        return pass_on(found);
    std::vector<DicomFrame> frames;
    for (const auto& [path, file] : found->files)
        frames.insert(frames.end(), file.frames.begin(), file.frames.end());
    std::vector<DicomSeries> all = group_series(std::move(frames));
    PALPATE_TRY(const size_t chosen, choose_series(request, all));
    std::vector<SeriesInfo> list;
    if (found->files.size() > 1 || all.size() > 1 || fs::is_directory(request.path))
        list = list_series(all, chosen);
    DicomSeries series = all[chosen];
    if (series.frames.front().object == DicomObject::segmentation) {
        PALPATE_TRY(Decoded decoded,
                    decode_segmentation(name, found->files.at(series.frames.front().file), sink));
        decoded.notes = std::move(found->notes);
        decoded.series = std::move(list);
        decoded.warnings.insert(decoded.warnings.begin(), found->warnings.begin(),
                                found->warnings.end());
        return decoded;
    }
    if (request.middle_image)
        series.frames = {middle_of(std::move(series.frames))};
    std::vector<std::string> warnings;
    const std::vector<DicomFrame> left_out = other_planes(all, chosen);
    warn_of_other_planes(name, all, chosen, warnings);
    set_damaged_aside(*found, series, sink);
    sink.alive();
    for (;;) { // until the codecs take every file that is left
        Decoded decoded;
        decoded.notes = found->notes;
        decoded.series = list;
        decoded.modality = series.modality;
        decoded.heeded_resample_slices = true;
        decoded.warnings = found->warnings;
        decoded.warnings.insert(decoded.warnings.end(), warnings.begin(), warnings.end());
        SampleComparison comparison(found->files, sink);
        Result<DicomStack> stack =
            make_stack(request, series, found->damaged, left_out, std::ref(comparison));
        if (!stack)
            return fail("{}{}{}", stack.error().message,
                        found->damaged > 0 ? "; " + found->warnings.back() : "",
                        left_out.empty() ? "" : "; " + warnings.back());
        decoded.warnings.insert(decoded.warnings.end(), stack->warnings.begin(),
                                stack->warnings.end());
        decoded.notes.insert(decoded.notes.end(), stack->notes.begin(), stack->notes.end());
        decoded.grid = stack->grid;
        decoded.inverted = series.frames.front().inverted;
        decoded.frame_of_reference = series.frames.front().frame_of_reference;
        if (request.reference) {
            PALPATE_TRY(decoded.reference, reference_of(name, found->files, *stack));
            return decoded;
        }

        const VoxelClaim claim = claim_of(found->files, *stack, decoded);
        PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
        const Failures failures = stack->resampled
                                      ? resample_pixels(found->files, *stack, voxels, sink)
                                      : copy_pixels(found->files, *stack, claim.type, voxels, sink);
        sink.alive();
        if (failures.empty())
            return decoded;
        if (!set_aside(*found, series, failures))
            return fail("{}", failures.begin()->second);
    }
}

} // namespace palpate::io
