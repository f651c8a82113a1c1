#include <algorithm>
#include <cstring>
#include <map>
#include <set>

#include "engine/io/dicom_file.h"
#include "engine/io/formats.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

using Files = std::map<fs::path, DicomFile>; // ordered by name, so that results do not vary

Result<Files> read_headers(const DecodeRequest& request, const VoxelSink& sink,
                           std::vector<std::string>& notes) {
    Files files;
    if (!fs::is_directory(request.path)) {
        Result<DicomFile> file = read_dicom_header(request.path);
        if (!file)
            return pass_on(file);
        files.emplace(request.path, std::move(*file));
        return files;
    }
    size_t passed_over = 0;
    std::string why;
    for (const fs::directory_entry& entry : fs::directory_iterator(request.path)) {
        if (!entry.is_regular_file())
            continue;
        sink.alive(entry.path().filename().string());
        Result<DicomFile> file = read_dicom_header(entry.path());
        if (file)
            files.emplace(entry.path(), std::move(*file));
        else if (++passed_over; why.empty() || file.error().message < why)
            why = file.error().message;
    }
    if (files.empty())
        return fail("{}: holds no DICOM image{}{}", request.path.string(),
                    why.empty() ? "" : "; for one, ", why);
    if (passed_over > 0)
        notes.push_back(fmt::format("{}: {} files are passed over; for one, {}",
                                    request.path.string(), passed_over, why));
    return files;
}

std::vector<std::string> list_of(const std::vector<DicomSeries>& all, size_t chosen) {
    std::vector<std::string> list;
    for (size_t i = 0; i < all.size(); ++i)
        list.push_back(fmt::format(
            "series {} of {}: {} '{}', {} images of {} x {}, {}{}", i + 1, all.size(),
            all[i].modality, all[i].description, all[i].frames.size(), all[i].frames.front().size.x,
            all[i].frames.front().size.y, all[i].uid, i == chosen ? " (read)" : ""));
    return list;
}

// One type that holds every file's: its own where they agree, else f64.
ComponentType common_type(const Files& files, const DicomStack& stack) {
    const ComponentType first = files.at(stack.frames.front().file).type;
    for (const DicomFrame& frame : stack.frames)
        if (files.at(frame.file).type != first)
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

Result<void> copy_pixels(const Files& files, const DicomStack& stack, ComponentType type,
                         std::span<std::byte> voxels, const VoxelSink& sink) {
    const size_t slice_bytes = voxels.size() / stack.frames.size();
    // A multi-frame file is decoded once for all its frames.
    std::map<fs::path, std::vector<size_t>> slices_of;
    for (size_t z = 0; z < stack.frames.size(); ++z)
        slices_of[stack.frames[z].file].push_back(z);
    for (const auto& [path, slices] : slices_of) {
        sink.alive(path.filename().string());
        const DicomFile& file = files.at(path);
        const Result<std::vector<char>> pixels = read_dicom_pixels(file);
        if (!pixels)
            return fail("{}", pixels.error().message);
        for (const size_t z : slices)
            copy_frame(file, *pixels, stack.frames[z].frame, type,
                       voxels.subspan(z * slice_bytes, slice_bytes));
    }
    return {};
}

} // namespace

Result<Decoded> decode_dicom(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    Decoded decoded;
    Result<Files> files = read_headers(request, sink, decoded.notes);
    if (!files)
        return pass_on(files);
    std::vector<DicomFrame> frames;
    for (const auto& [path, file] : *files)
        frames.insert(frames.end(), file.frames.begin(), file.frames.end());
    std::vector<DicomSeries> all = group_series(std::move(frames));
    const Result<size_t> chosen = choose_series(request, all);
    if (!chosen)
        return fail("{}", chosen.error().message);
    if (fs::is_directory(request.path)) {
        const std::vector<std::string> list = list_of(all, *chosen);
        decoded.notes.insert(decoded.notes.end(), list.begin(), list.end());
    }
    decoded.modality = all[*chosen].modality;
    Result<DicomStack> stack = make_stack(request, std::move(all[*chosen]));
    if (!stack)
        return pass_on(stack);
    decoded.warnings = std::move(stack->warnings);
    decoded.grid = stack->grid;

    VoxelClaim claim;
    claim.size = stack->grid.size;
    claim.type = common_type(*files, *stack);
    uint64_t largest = 0;
    std::set<fs::path> counted;
    for (const DicomFrame& frame : stack->frames) {
        decoded.rescale.push_back(frame.rescale);
        const DicomFile& file = files->at(frame.file);
        if (!counted.insert(frame.file).second)
            continue;
        decoded.warnings.insert(decoded.warnings.end(), file.warnings.begin(), file.warnings.end());
        claim.source_bytes += file.bytes;
        claim.most_expansion = std::max(claim.most_expansion, file.most_expansion);
        // GDCM holds the encoded and the decoded pixels of a file, and copies them out.
        largest = std::max(largest, 2 * file.bytes + 3 * uint64_t{frame.size.x} * frame.size.y *
                                                         file.frames.size() *
                                                         bytes_per_component(file.type));
    }
    if (claim.type == ComponentType::f64 && claim.most_expansion == kRawExpansion)
        claim.most_expansion = 8.0; // widened from as little as one byte
    claim.working_bytes = largest;
    Result<std::span<std::byte>> voxels = sink.allocate(name, claim);
    if (!voxels)
        return pass_on(voxels);
    if (Result<void> copied = copy_pixels(*files, *stack, claim.type, *voxels, sink); !copied)
        return pass_on(copied);
    return decoded;
}

} // namespace palpate::io
