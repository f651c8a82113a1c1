#include "engine/decode/affine.h"
#include "engine/decode/formats.h"
#include "engine/decode/meta_image_header.h"
#include "engine/decode/payload.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

Result<void> place(const std::string& name, const fs::path& first_file,
                   const MetaImageHeader& header, Payload& payload) {
    const bool local = header.is_local();
    payload.file = first_file;
    payload.offset = local ? header.bytes : 0;
    if (!header.binary)
        payload.encoding = Encoding::ascii;
    else if (header.compressed)
        payload.encoding = Encoding::deflate;
    if (header.header_size > 0) {
        if (local)
            return fail("{}: expected a HeaderSize of 0 or -1 with local data, found {}", name,
                        header.header_size);
        payload.offset = static_cast<uint64_t>(header.header_size);
    } else if (header.header_size < 0) {
        if (payload.encoding != Encoding::raw)
            return fail("{}: expected a HeaderSize of 0 or more with packed data, found -1", name);
        payload.skip.reset();
    }
    return {};
}

} // namespace

Result<Decoded> decode_meta_image(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    PALPATE_TRY(const std::string text, load_beginning(name));
    Decoded decoded;
    PALPATE_TRY(const MetaImageHeader header,
                parse_meta_image_header(name, text, decoded.warnings));
    Payload payload;
    payload.type = header.type;
    payload.big_endian = header.big_endian;
    payload.components = header.components;
    payload.size = glm::uvec3(1);
    uint64_t frames = 1;
    for (size_t i = 0; i < header.sizes.size(); ++i) {
        if (i < 3)
            payload.size[static_cast<int>(i)] = static_cast<uint32_t>(header.sizes[i]);
        else
            frames *= static_cast<uint64_t>(header.sizes[i]);
        if (frames > INT32_MAX)
            return fail("{}: expected at most {} frames, found more", name, INT32_MAX);
    }
    payload.frames = frames;
    PALPATE_TRY(payload.frame,
                choose_frame(request, static_cast<uint32_t>(frames), decoded.warnings));
    PALPATE_TRY(decoded.grid, grid_from_columns(name, payload.size, header.steps, header.origin));
    if (header.rescale != Rescale{})
        decoded.rescale = {header.rescale};
    decoded.modality = header.modality;
    PALPATE_TRY(const std::vector<fs::path> files, meta_image_data_files(request.path, header));
    PALPATE_TRY(place(name, files.empty() ? request.path : files.front(), header, payload));
    if (files.size() > 1) {
        payload.file = request.path;
        PALPATE_TRY(read_file_list(payload, files, sink, decoded.warnings));
        return decoded;
    }
    PALPATE_TRY(read_payload(payload, sink, decoded.warnings));
    return decoded;
}

} // namespace palpate::io
