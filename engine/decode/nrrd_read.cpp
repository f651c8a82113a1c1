#include "engine/decode/affine.h"
#include "engine/decode/formats.h"
#include "engine/decode/nrrd_header.h"
#include "engine/decode/nrrd_layers.h"
#include "engine/decode/payload.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

// Which way the axes of the file's space point; LPS with a warning where it does not say.
glm::dvec3 axes_of(const std::string& name, const NrrdHeader& header,
                   std::vector<std::string>& warnings) {
    if (header.space == "left-posterior-superior")
        return kLps;
    if (header.space == "right-anterior-superior")
        return kRas;
    if (header.space == "left-anterior-superior")
        return kLas;
    warnings.push_back(fmt::format(
        "{}: {}; the axes are taken as left, posterior, superior", name,
        header.space.empty()
            ? "names no space"
            : fmt::format("its space \"{}\" names no side of the patient", header.space)));
    return kLps;
}

// Sorts the axes of the array into space, interleaved components and frames. Frames of a list or of
// times may lie before, between or after the axes in space, others after them.
Result<void> arrange(const std::string& name, const NrrdHeader& header, Payload& payload,
                     std::vector<const NrrdHeader::Axis*>& spatial) {
    uint64_t before = 1; // numbers before the first frame axis
    uint64_t frames = 1, components = 1;
    bool has_frames = false, has_passed_frames = false, has_unknown = false;
    for (const NrrdHeader::Axis& axis : header.axes) {
        const auto size = static_cast<uint64_t>(axis.size); // below 2^31
        const bool is_space = axis.is_spatial && spatial.size() < 3;
        if (is_space || (!axis.is_list && spatial.empty())) {
            if (has_unknown)
                return fail(
                    "{}: expected frames after the spatial axes or on an axis of the kind list, "
                    "found them between",
                    name);
            if (is_space)
                spatial.push_back(&axis);
            else
                components *= size;
            has_passed_frames = has_passed_frames || (has_frames && size > 1);
            if (!has_frames && before < (uint64_t{1} << 62) / size)
                before *= size;
        } else {
            if (size > 1 && has_passed_frames)
                return fail(
                    "{}: expected its frames on axes that follow one another, found others "
                    "between them",
                    name);
            frames *= size;
            has_frames = has_frames || size > 1;
            has_unknown = has_unknown || (size > 1 && !axis.is_list);
        }
        if (components > INT32_MAX || frames > INT32_MAX)
            return fail("{}: expected at most {} components and frames, found more", name,
                        INT32_MAX);
    }
    if (spatial.empty())
        return fail("{}: expected an axis in space, found none", name);
    payload.components = static_cast<uint32_t>(components);
    payload.frames = frames;
    payload.size = glm::uvec3(1);
    for (size_t i = 0; i < spatial.size(); ++i)
        payload.size[static_cast<int>(i)] = static_cast<uint32_t>(spatial[i]->size);
    payload.run = has_frames ? before : 0;
    return {};
}

Result<Grid> nrrd_grid(const std::string& name, const NrrdHeader& header,
                       const std::vector<const NrrdHeader::Axis*>& spatial, glm::uvec3 size,
                       std::vector<std::string>& warnings) {
    const glm::dvec3 unit = header.mm_per_unit.value_or(glm::dvec3(spatial[0]->mm_per_unit));
    glm::dmat3 steps(0);
    glm::dvec3 origin{};
    for (size_t i = 0; i < spatial.size(); ++i) {
        const int axis = static_cast<int>(i);
        if (!spatial[i]->direction)
            steps[axis][axis] =
                spatial[i]->spacing * (header.mm_per_unit ? unit[axis] : spatial[i]->mm_per_unit);
        else if (header.mm_per_unit)
            steps[axis] = *spatial[i]->direction * unit;
        else
            steps[axis] = *spatial[i]->direction * spatial[i]->mm_per_unit;
    }
    if (header.origin)
        origin = *header.origin * unit;
    return grid_from_columns(name, size, steps, origin, axes_of(name, header, warnings));
}

// The byte after `lines` line ends, from `offset` on.
Result<uint64_t> after_lines(const fs::path& file, uint64_t offset, int64_t lines) {
    PALPATE_TRY(ByteSource source, ByteSource::open(file, Packing::none, offset));
    std::array<char, 1 << 12> part;
    for (int64_t left = lines; left > 0;) {
        PALPATE_TRY(const size_t got, source.read(std::as_writable_bytes(std::span(part))));
        if (got == 0)
            return fail("{}: expected {} lines to skip, found {}", file.string(), lines,
                        lines - left);
        for (size_t i = 0; i < got && left > 0; ++i, ++offset)
            left -= part[i] == '\n';
    }
    return offset;
}

Result<void> place(const std::string& name, const fs::path& first_file, const NrrdHeader& header,
                   Payload& payload) {
    payload.file = first_file;
    payload.offset = header.data_file.empty() ? header.bytes : 0;
    if (header.line_skip > 0) {
        PALPATE_TRY(payload.offset, after_lines(payload.file, payload.offset, header.line_skip));
    }
    switch (header.encoding) {
        case NrrdHeader::Encoding::raw:
            payload.encoding = Encoding::raw;
            break;
        case NrrdHeader::Encoding::gzip:
            payload.encoding = Encoding::deflate;
            break;
        case NrrdHeader::Encoding::ascii:
            payload.encoding = Encoding::ascii;
            if (header.byte_skip < 0)
                return fail("{}: expected a byte skip of 0 or more with text, found {}", name,
                            header.byte_skip);
            payload.offset += static_cast<uint64_t>(header.byte_skip);
            return {};
    }
    payload.skip.reset();
    if (header.byte_skip >= 0)
        payload.skip = static_cast<uint64_t>(header.byte_skip);
    return {};
}

// A data file may be a whole NIfTI file, whose own header comes first. A NRRD header that skips
// nothing would read it shifted: the voxels are then taken from the end, with a warning.
Result<void> pass_nifti_header(const std::string& name, Payload& payload,
                               std::vector<std::string>& warnings) {
    if (payload.encoding == Encoding::ascii || payload.skip != 0u)
        return {};
    const Packing packing = payload.encoding == Encoding::raw ? Packing::none : Packing::deflate;
    PALPATE_TRY(ByteSource source, ByteSource::open(payload.file, packing, payload.offset));
    std::array<char, 348> head;
    Result<size_t> got = source.read(std::as_writable_bytes(std::span(head)));
    if (!got || *got < head.size() ||
        std::string_view(&head[344], 4) != std::string_view("n+1\0", 4))
        return {}; // what is damaged is found when the voxels are read
    PALPATE_TRY(const uint64_t rest, source.skip(UINT64_MAX));
    payload.skip.reset();
    warnings.push_back(fmt::format(
        "{}: the data file {} holds {} bytes and is a NIfTI file of its own; the header "
        "claims {}, which are taken from its end",
        name, payload.file.filename().string(), *got + rest, describe(payload)));
    return {};
}

} // namespace

Result<Decoded> decode_nrrd(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    PALPATE_TRY(const std::string text, load_beginning(name));
    Decoded decoded;
    PALPATE_TRY(const NrrdHeader header, parse_nrrd_header(name, text, decoded.warnings));
    decoded.modality = header.modality;
    Payload payload;
    payload.type = header.type;
    payload.big_endian = header.big_endian;
    std::vector<const NrrdHeader::Axis*> spatial;
    PALPATE_TRY(arrange(name, header, payload, spatial));
    PALPATE_TRY(decoded.grid, nrrd_grid(name, header, spatial, payload.size, decoded.warnings));
    PALPATE_TRY(const std::vector<fs::path> files, nrrd_data_files(request.path, header));
    if (files.size() > 1 && header.line_skip > 0)
        return fail("{}: expected data files without a line skip in a list of them", name);
    PALPATE_TRY(place(name, files.empty() ? request.path : files.front(), header, payload));
    if (has_layers(header)) {
        if (files.size() > 1)
            return fail("{}: expected the layers of a segmentation in one data file, found {}",
                        name, files.size());
        PALPATE_TRY(choose_frame(request, 1, decoded.warnings));
        PALPATE_TRY(read_layers(name, header, payload, sink, decoded));
        return decoded;
    }
    decoded.labels = names_of_labels(header);
    PALPATE_TRY(payload.frame,
                choose_frame(request, static_cast<uint32_t>(payload.frames), decoded.warnings));
    if (files.size() > 1) {
        payload.file = request.path;
        PALPATE_TRY(read_file_list(payload, files, sink, decoded.warnings));
        return decoded;
    }
    PALPATE_TRY(pass_nifti_header(name, payload, decoded.warnings));
    PALPATE_TRY(read_payload(payload, sink, decoded.warnings));
    return decoded;
}

} // namespace palpate::io
