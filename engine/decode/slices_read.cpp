#include <algorithm>
#include <fstream>

#include "engine/base/option_name.h"
#include "engine/decode/formats.h"
#include "engine/decode/payload.h"
#include "engine/decode/picture.h"
#include "engine/decode/slice_list.h"
#include "engine/decode/tiff_stack.h"
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

Grid grid_of(const std::string& name, const SliceSidecar& sidecar,
             const std::optional<glm::dvec3>& stated_mm, glm::uvec3 size,
             std::vector<std::string>& warnings) {
    if (!sidecar.spacing_mm && !stated_mm)
        warnings.push_back(
            fmt::format("{}: slices do not state their spacing, 1 x 1 x 1 mm is "
                        "assumed ({} beside them may state it)",
                        name, kSidecarName));
    const glm::dvec3 spacing = sidecar.spacing_mm.value_or(stated_mm.value_or(glm::dvec3(1.0)));
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

// Reads the slices of one channel at one time out of a TIFF, whose other pages are read too.
Result<void> read_stack(const fs::path& file, const TiffStack& stack, uint32_t frame,
                        const PictureHeader& pages, VoxelSink& sink, VoxelClaim& claim) {
    const std::string name = file.string();
    claim.size = {pages.size.x, pages.size.y, stack.slices};
    VoxelClaim all = claim;
    all.size = pages.size;
    const std::optional<uint64_t> all_bytes = claimed_bytes(all);
    if (!all_bytes)
        return fail("{}: its pages are of no possible size", name);
    claim.working_bytes = 4 * *all_bytes;
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    std::vector<std::byte> every(*all_bytes);
    PALPATE_TRY(read_picture(file, every));
    const size_t page = voxels.size() / stack.slices;
    for (size_t z = 0; z < stack.slices; ++z)
        std::copy_n(&every[page * stack.pages[z + size_t{stack.slices} * frame]], page,
                    &voxels[page * z]);
    return {};
}

// ImageJ's stacks of more than 4 GiB have one page, behind which the pixels of all follow, by
// channel, then slice, then time.
Result<void> read_raw_stack(const fs::path& file, const TiffStack& stack, uint32_t frame,
                            const PictureHeader& page, VoxelSink& sink, VoxelClaim& claim,
                            std::vector<std::string>& warnings) {
    Payload payload;
    payload.file = file;
    payload.type = page.type;
    payload.big_endian = stack.big_endian;
    payload.components = page.components;
    payload.size = {page.size.x, page.size.y, stack.slices};
    payload.run = uint64_t{page.size.x} * page.size.y * page.components;
    payload.frames = stack.channels;
    payload.frame = frame % stack.channels;
    payload.has_footer = true;
    const uint64_t time = frame / stack.channels;
    claim.size = payload.size;
    payload.offset = *stack.raw_from;
    if (const std::optional<uint64_t> bytes = claimed_bytes(claim); bytes && time > 0)
        payload.offset += time * std::min(*bytes * stack.channels, uint64_t{1} << 40);
    return read_payload(payload, sink, warnings);
}

// Reads what TIFF files state beside their pixels.
Result<std::optional<TiffStack>> stack_of(const Slices& slices, const PictureHeader& first,
                                          std::vector<std::string>& warnings) {
    const fs::path& file = slices.files.front();
    if (!lower_case(file.extension().string()).starts_with(".tif"))
        return std::optional<TiffStack>();
    if (slices.files.size() == 1)
        return read_tiff_stack(file, first.size.z, warnings);
    std::vector<std::string> ignored; // of a series: a file's metadata may be those of the whole
    return read_tiff_stack(file, first.size.z, ignored).value_or(std::optional<TiffStack>());
}

Result<void> read_pictures(const std::string& name, const Slices& slices,
                           const DecodeRequest& request, VoxelSink& sink, VoxelClaim& claim,
                           Decoded& decoded, std::optional<glm::dvec3>& stated_mm) {
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
    const bool is_one = slices.files.size() == 1;
    PALPATE_TRY(const std::optional<TiffStack> stack, stack_of(slices, first, decoded.warnings));
    if (stack) {
        stated_mm = stack->spacing_mm;
        if (stack->rescale)
            decoded.rescale = {*stack->rescale};
    }
    std::vector<std::string> ignored;
    PALPATE_TRY(const uint32_t frame,
                choose_frame(request, is_one && stack ? stack->frames() : 1, ignored));
    if (is_one && stack && stack->frames() > 1 && !request.frame)
        decoded.warnings.push_back(fmt::format(
            "{}: has {}; the first is read ({} chooses{})", name, stack->words(), Option{"frame"},
            stack->channels > 1 && stack->times > 1
                ? fmt::format(": channel + {} x time", stack->channels)
                : ""));
    if (is_one && stack && stack->raw_from)
        return read_raw_stack(slices.files.front(), *stack, frame, first, sink, claim,
                              decoded.warnings);
    if (is_one && stack && !stack->is_plain(first.size.z))
        return read_stack(slices.files.front(), *stack, frame, first, sink, claim);
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
    PALPATE_TRY(const uint64_t bytes, bytes_of(slices.files));
    VoxelClaim claim;
    claim.source_bytes = bytes;
    std::optional<glm::dvec3> stated_mm;
    if (is_picture(lower_case(slices.files.front().extension().string()))) {
        PALPATE_TRY(read_pictures(name, slices, request, sink, claim, decoded, stated_mm));
    } else {
        PALPATE_TRY(choose_frame(request, 1, decoded.warnings));
        PALPATE_TRY(read_raw(name, slices, sink, claim, decoded.warnings));
    }
    decoded.grid = grid_of(name, slices.sidecar, stated_mm, claim.size, decoded.warnings);
    decoded.modality = slices.sidecar.modality;
    return decoded;
}

} // namespace palpate::io
