#pragma once

#include "engine/io/byte_source.h"
#include "engine/io/decoder.h"

namespace palpate::io {

// How the voxels of a file are written down.
enum class Encoding : uint8_t { raw, deflate, ascii };

// Where the voxels of a volume lie in a file, as a header says.
struct Payload {
    std::filesystem::path file;
    Encoding encoding = Encoding::raw;
    uint64_t offset = 0;              // byte of the file at which the encoded voxels begin
    std::optional<uint64_t> skip = 0; // decoded bytes before the first voxel (not for ascii);
                                      // absent: the voxels are the last bytes
    ComponentType type{};
    bool big_endian = false;
    glm::uvec3 size{};
    uint32_t components = 1; // interleaved
    uint64_t frames = 1;     // volumes that follow one another
    uint64_t frame = 0;      // the one to read; < frames
    bool has_footer = false; // bytes after the last frame belong to the format
};

// Reads one frame into the sink, in native byte order.
//
// Before memory is taken, the bytes of all frames are held against what the file can hold. A file
// that holds fewer is refused with both numbers, one that holds more is a warning with both.
Result<void> read_payload(const Payload& payload, VoxelSink& sink,
                          std::vector<std::string>& warnings);

// "12 x 10 x 5 x 20 voxels of i16 (24000 bytes)"
std::string describe(const Payload& payload);

} // namespace palpate::io
