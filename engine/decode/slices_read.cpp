#include <algorithm>
#include <fstream>

#include "engine/decode/formats.h"
#include "engine/decode/picture.h"
#include "engine/decode/slice_list.h"
#include "engine/io/byte_source.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

// Voxel bytes a byte of a picture can stand for: past deflate's 1032, since JPEG and TIFF pack an
// empty page further.
constexpr double kPictureExpansion = 4000.0;

struct Slices {
    std::vector<fs::path> files;
    SliceSidecar sidecar;
    fs::path described_by; // the sidecar; empty when there is none
};

Result<Slices> find_slices(const fs::path& path, std::vector<std::string>& warnings) {
    Slices slices;
    std::string pattern;
    fs::path folder = path;
    if (!fs::is_directory(path)) {
        folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
        if (fs::exists(path))
            slices.files = {path};
        else
            pattern = path.filename().string();
    }
    if (fs::exists(folder / kSidecarName)) {
        slices.described_by = folder / kSidecarName;
        PALPATE_TRY(slices.sidecar, load_sidecar(slices.described_by));
    }
    if (!slices.files.empty())
        return slices;
    if (pattern.empty())
        pattern = slices.sidecar.pattern.value_or("");
    PALPATE_TRY(slices.files, pattern.empty() ? pictures_of(folder, warnings)
                                              : files_matching(folder, pattern, warnings));
    return slices;
}

Grid grid_of(const std::string& name, const SliceSidecar& sidecar, glm::uvec3 size,
             std::vector<std::string>& warnings) {
    if (!sidecar.spacing_mm)
        warnings.push_back(
            fmt::format("{}: slices do not state their spacing, 1 x 1 x 1 mm is "
                        "assumed ({} beside them may state it)",
                        name, kSidecarName));
    const glm::dvec3 spacing = sidecar.spacing_mm.value_or(glm::dvec3(1.0));
    Grid grid;
    grid.size = size;
    for (int axis = 0; axis < 3; ++axis)
        grid.world_from_index[axis] = glm::dvec4(sidecar.directions[axis] * spacing[axis], 0.0);
    grid.world_from_index[3] = glm::dvec4(sidecar.origin_mm, 1.0);
    return grid;
}

Result<uint64_t> bytes_of(const std::vector<fs::path>& files) {
    uint64_t total = 0;
    for (const fs::path& file : files) {
        PALPATE_TRY(const uint64_t bytes, regular_file_bytes(file));
        total += bytes;
    }
    return total;
}

Result<void> read_pictures(const std::string& name, const Slices& slices, VoxelSink& sink,
                           VoxelClaim& claim) {
    PALPATE_TRY(const PictureHeader first, read_picture_header(slices.files.front()));
    if (first.size.z > 1 && slices.files.size() > 1)
        return fail("{}: has {} pages, expected one page a slice", slices.files.front().string(),
                    first.size.z);
    for (const fs::path& file : slices.files) {
        sink.alive(file);
        PALPATE_TRY(const PictureHeader header, read_picture_header(file));
        if (header.size != first.size || header.type != first.type ||
            header.components != first.components)
            return fail("{}: mixed sizes: {} is {} x {} of {} x {}, {} is {} x {} of {} x {}", name,
                        slices.files.front().filename().string(), first.size.x, first.size.y,
                        first.components, name_of(first.type), file.filename().string(),
                        header.size.x, header.size.y, header.components, name_of(header.type));
    }
    claim.size = {first.size.x, first.size.y, std::max<size_t>(first.size.z, slices.files.size())};
    claim.type = first.type;
    claim.components = first.components;
    claim.most_expansion = kPictureExpansion;
    VoxelClaim one = claim;
    one.size = first.size;
    claim.working_bytes = 3 * claimed_bytes(one).value_or(0);
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    const size_t slice_bytes = voxels.size() / slices.files.size();
    for (size_t i = 0; i < slices.files.size(); ++i) {
        sink.alive(slices.files[i]);
        PALPATE_TRY(read_picture(slices.files[i], voxels.subspan(i * slice_bytes, slice_bytes)));
    }
    return {};
}

Result<void> read_raw(const std::string& name, const Slices& slices, VoxelSink& sink,
                      VoxelClaim& claim, std::vector<std::string>& warnings) {
    const SliceSidecar& sidecar = slices.sidecar;
    if (!sidecar.size || !sidecar.type)
        return fail(
            "{}: slices without a header of their own need the keys pattern, size and type "
            "in {}",
            name, kSidecarName);
    claim.size = {sidecar.size->x, sidecar.size->y, slices.files.size()};
    claim.type = *sidecar.type;
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    const size_t slice_bytes = voxels.size() / slices.files.size();
    std::string longer;
    for (size_t i = 0; i < slices.files.size(); ++i) {
        sink.alive(slices.files[i]);
        const std::span<std::byte> slice = voxels.subspan(i * slice_bytes, slice_bytes);
        std::ifstream in(slices.files[i], std::ios::binary);
        in.seekg(static_cast<std::streamoff>(sidecar.header_bytes));
        in.read(reinterpret_cast<char*>(slice.data()), static_cast<std::streamsize>(slice_bytes));
        const uint64_t found = fs::file_size(slices.files[i]);
        const uint64_t expected = sidecar.header_bytes + slice_bytes;
        if (!in)
            return fail(
                "{}: expected {} bytes ({} x {} samples of {} after a header of {}), found "
                "{}",
                slices.files[i].string(), expected, sidecar.size->x, sidecar.size->y,
                name_of(claim.type), sidecar.header_bytes, found);
        if (found > expected && longer.empty())
            longer = fmt::format("{}: holds {} bytes, {} are read as {} says",
                                 slices.files[i].string(), found, expected, kSidecarName);
        if (sidecar.big_endian)
            swap_bytes(slice, bytes_per_component(claim.type));
    }
    if (!longer.empty())
        warnings.push_back(longer);
    return {};
}

} // namespace

Result<Decoded> decode_slices(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    Decoded decoded;
    PALPATE_TRY(const Slices slices, find_slices(request.path, decoded.warnings));
    PALPATE_TRY(choose_frame(request, 1, decoded.warnings));
    PALPATE_TRY(const uint64_t bytes, bytes_of(slices.files));
    VoxelClaim claim;
    claim.source_bytes = bytes;
    PALPATE_TRY(is_picture(lower_case(slices.files.front().extension().string()))
                    ? read_pictures(name, slices, sink, claim)
                    : read_raw(name, slices, sink, claim, decoded.warnings));
    decoded.grid = grid_of(name, slices.sidecar, claim.size, decoded.warnings);
    decoded.modality = slices.sidecar.modality;
    return decoded;
}

} // namespace palpate::io
