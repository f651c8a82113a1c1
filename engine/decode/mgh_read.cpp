#include "engine/decode/formats.h"
#include "engine/decode/mgh_header.h"
#include "engine/decode/payload.h"

namespace palpate::io {

Result<Decoded> decode_mgh(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    PALPATE_TRY(const Packing packing, packing_of(request.path));
    PALPATE_TRY(ByteSource source, ByteSource::open(request.path, packing));
    std::array<std::byte, kMghHeaderBytes> bytes{};
    PALPATE_TRY(const size_t got, source.read(bytes));
    PALPATE_TRY(const MghHeader header, parse_mgh_header(name, {bytes.data(), got}));

    Decoded decoded;
    Payload payload;
    payload.file = request.path;
    payload.type = header.type;
    payload.big_endian = true;
    payload.size = header.size;
    payload.frames = header.frames;
    payload.has_footer = true;
    if (packing == Packing::deflate) {
        payload.encoding = Encoding::deflate;
        payload.skip = kMghHeaderBytes;
    } else {
        payload.offset = kMghHeaderBytes;
    }
    PALPATE_TRY(payload.frame, choose_frame(request, header.frames, decoded.warnings));
    PALPATE_TRY(decoded.grid, mgh_grid(name, header, decoded.warnings));
    PALPATE_TRY(read_payload(payload, sink, decoded.warnings));
    return decoded;
}

} // namespace palpate::io
