#include <cctype>
#include <cmath>

#include "engine/decode/formats.h"
#include "engine/decode/nifti_header.h"
#include "engine/decode/nifti_labels.h"
#include "engine/decode/payload.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

Result<ComponentType> nifti_component_type(const std::string& name, int datatype) {
    constexpr TypeKey<int> types[] = {{2, ComponentType::u8},     {4, ComponentType::i16},
                                      {8, ComponentType::i32},    {16, ComponentType::f32},
                                      {64, ComponentType::f64},   {256, ComponentType::i8},
                                      {512, ComponentType::u16},  {768, ComponentType::u32},
                                      {1024, ComponentType::i64}, {1280, ComponentType::u64}};
    if (const auto found = find_type(types, datatype))
        return *found;
    switch (datatype) {
        case 1:
            return fail("{}: holds single bits, which cannot be read", name);
        case 32:
        case 1792:
        case 2048:
            return fail("{}: holds complex numbers; expected one real number a voxel", name);
        case 128:
        case 2304:
            return fail("{}: holds colours (RGB); expected one number a voxel", name);
        case 1536:
            return fail("{}: holds 128-bit floats, which cannot be read", name);
    }
    return fail("{}: expected a NIfTI data type, found number {}", name, datatype);
}

Result<NiftiHeader> load_header(const fs::path& path, Packing packing) {
    PALPATE_TRY(ByteSource source, ByteSource::open(path, packing));
    std::array<std::byte, kNifti2Bytes> bytes{};
    // The packing's error counts for a short packed file, and the header's own for a short header.
    PALPATE_TRY(const size_t got, source.read(bytes));
    return parse_nifti_header(path.string(), {bytes.data(), got});
}

struct Shape {
    glm::uvec3 size{1};
    uint32_t frames = 1;
};

Result<Shape> shape_of(const std::string& name, const NiftiHeader& header) {
    constexpr int64_t most = INT32_MAX;
    const int64_t count = header.dim[0];
    if (count < 1 || count > 7)
        return fail("{}: expected 1 to 7 dimensions, found {}", name, count);
    std::array<int64_t, 7> sizes{1, 1, 1, 1, 1, 1, 1};
    for (int64_t i = 0; i < count; ++i) {
        const int64_t size = header.dim[i + 1];
        if (size < 0 || size > most || (size == 0 && i < 3))
            return fail("{}: expected a size of 1 to {} in dimension {}, found {}", name, most,
                        i + 1, size);
        sizes[i] = std::max<int64_t>(size, 1); // 0 stands for "unused" beyond space
    }
    for (const int i : {4, 5, 6})
        if (sizes[i] > 1)
            return fail(
                "{}: holds several components ({} in dimension {}); expected one number a "
                "voxel",
                name, sizes[i], i + 1);
    return Shape{{sizes[0], sizes[1], sizes[2]}, static_cast<uint32_t>(sizes[3])};
}

Result<uint64_t> voxel_offset(const std::string& name, const NiftiHeader& header) {
    const double offset = header.vox_offset;
    if (!(offset >= 0 && offset < 9e15) || offset != std::floor(offset))
        return fail("{}: expected a whole vox_offset of 0 or more, found {}", name, offset);
    if (header.pair)
        return static_cast<uint64_t>(offset);
    // Header and the four bytes that say whether extensions follow.
    const size_t least =
        (header.kind == NiftiHeader::Kind::nifti2 ? kNifti2Bytes : kNifti1Bytes) + 4;
    if (offset == 0)
        return least;
    if (offset < static_cast<double>(least))
        return fail("{}: expected a vox_offset of {} or more, found {}", name, least, offset);
    return static_cast<uint64_t>(offset);
}

bool has_extension(const fs::path& path, std::string_view extension) {
    const std::string name = lower_case(path.filename().string());
    return name.ends_with(extension) || name.ends_with(std::string(extension) + ".gz");
}

// The other file of a pair: only the extension differs, ".hdr" or ".img". Each of the two may be
// packed, and its letters may be capitals; what is most like the name of `path` comes first.
Result<fs::path> other_of_pair(const fs::path& path, const char* extension) {
    const std::string name = path.filename().string();
    const bool is_packed = lower_case(name).ends_with(".gz");
    const size_t dot = name.size() - (is_packed ? 7 : 4); // of ".hdr.gz" or ".hdr"
    const bool is_upper = name[dot + 1] < 'a';
    std::optional<Error> first;
    for (const bool upper : {is_upper, !is_upper})
        for (const bool packed : {is_packed, !is_packed}) {
            std::string other = std::string(extension) + (packed ? ".gz" : "");
            if (upper)
                for (char& letter : other)
                    letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
            const Result<fs::path> found = file_beside(path, name.substr(0, dot) + other);
            if (found)
                return found;
            if (!first)
                first = found.error();
        }
    return tl::unexpected(*first);
}

std::vector<Rescale> rescale_of(const std::string& name, const NiftiHeader& header,
                                std::vector<std::string>& warnings) {
    if (header.scl_slope == 0 || !std::isfinite(header.scl_slope))
        return {}; // nifti1.h: a slope of 0 means that values are not scaled
    Rescale rescale{header.scl_slope, header.scl_inter};
    if (!std::isfinite(rescale.intercept)) {
        warnings.push_back(
            fmt::format("{}: scl_inter is {}; 0 is assumed", name, rescale.intercept));
        rescale.intercept = 0;
    }
    if (rescale == Rescale{})
        return {};
    return {rescale};
}

} // namespace

Result<Decoded> decode_nifti(const DecodeRequest& request, VoxelSink& sink) {
    fs::path header_path = request.path;
    if (has_extension(request.path, ".img")) {
        PALPATE_TRY(header_path, other_of_pair(request.path, ".hdr"));
    }
    const std::string name = header_path.string();
    PALPATE_TRY(Packing packing, packing_of(header_path));
    PALPATE_TRY(const NiftiHeader header, load_header(header_path, packing));
    if (header.kind == NiftiHeader::Kind::analyze && !has_extension(header_path, ".hdr"))
        return fail("{}: expected the mark n+1 or ni1 of NIfTI-1, found none", name);

    Decoded decoded;
    Payload payload;
    payload.file = header_path;
    payload.big_endian = header.big_endian;
    PALPATE_TRY(payload.type, nifti_component_type(name, header.datatype));
    PALPATE_TRY(const Shape shape, shape_of(name, header));
    payload.size = shape.size;
    payload.frames = shape.frames;
    PALPATE_TRY(payload.frame, choose_frame(request, shape.frames, decoded.warnings));
    PALPATE_TRY(decoded.grid, nifti_grid(name, header, shape.size, decoded.warnings));
    decoded.rescale = rescale_of(name, header, decoded.warnings);
    decoded.labels = nifti_label_names(header_path, packing, header, decoded.warnings);

    if (header.pair) {
        PALPATE_TRY(payload.file, other_of_pair(header_path, ".img"));
        PALPATE_TRY(packing, packing_of(payload.file));
    }
    PALPATE_TRY(const uint64_t offset, voxel_offset(name, header));
    if (packing == Packing::deflate) {
        payload.encoding = Encoding::deflate;
        payload.skip = offset;
    } else {
        payload.offset = offset;
    }
    PALPATE_TRY(read_payload(payload, sink, decoded.warnings));
    return decoded;
}

} // namespace palpate::io
