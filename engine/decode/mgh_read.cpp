#include "engine/decode/formats.h"
#include "engine/decode/mgh_header.h"
#include "engine/decode/payload.h"

namespace palpate::io {

Result<Decoded> decode_mgh(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    Result<Packing> packing = packing_of(request.path);
    if (!packing)
        return pass_on(packing);
    Result<ByteSource> source = ByteSource::open(request.path, *packing);
    if (!source)
        return pass_on(source);
    std::array<std::byte, kMghHeaderBytes> bytes{};
    Result<size_t> got = source->read(bytes);
    if (!got)
        return pass_on(got);
    Result<MghHeader> header = parse_mgh_header(name, {bytes.data(), *got});
    if (!header)
        return pass_on(header);

    Decoded decoded;
    Payload payload;
    payload.file = request.path;
    payload.type = header->type;
    payload.big_endian = true;
    payload.size = header->size;
    payload.frames = header->frames;
    payload.has_footer = true;
    if (*packing == Packing::deflate) {
        payload.encoding = Encoding::deflate;
        payload.skip = kMghHeaderBytes;
    } else {
        payload.offset = kMghHeaderBytes;
    }
    Result<uint32_t> frame = choose_frame(request, header->frames, decoded.warnings);
    if (!frame)
        return pass_on(frame);
    payload.frame = *frame;
    Result<Grid> grid = mgh_grid(name, *header, decoded.warnings);
    if (!grid)
        return pass_on(grid);
    decoded.grid = *grid;
    if (Result<void> read = read_payload(payload, sink, decoded.warnings); !read)
        return pass_on(read);
    return decoded;
}

} // namespace palpate::io
