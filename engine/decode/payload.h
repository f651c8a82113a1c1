#pragma once

#include "engine/io/byte_source.h"
#include "engine/io/decoder.h"

namespace palpate::io {

// How the voxels of a file are written down.
enum class Encoding : uint8_t { raw, deflate, ascii };

// The place of a volume's voxels in a file, as a header says.
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
    uint64_t frames = 1;     // volumes in the file
    uint64_t frame = 0;      // the one to read; < frames
    // Numbers of one frame that lie together before those of the next frame; it divides the numbers
    // of a frame. 1: frames are interleaved number by number. 0: whole frames follow one another.
    uint64_t run = 0;
    bool has_footer = false; // bytes after the last frame belong to the format
};

// Reads one frame into the sink, in native byte order.
//
// Before memory is taken, the bytes of all frames are held against what the file can hold. A file
// that holds fewer is refused with both numbers, one that holds more is a warning with both.
Result<void> read_payload(const Payload& payload, VoxelSink& sink,
                          std::vector<std::string>& warnings);

// The same for a payload that is spread evenly over several files, each written as `payload` says;
// payload.file is the header, for messages. Raw files must hold as many bytes as the others after
// payload.skip. A file holds whole slices or the like of one frame, or whole frames; of interleaved
// frames it holds the numbers of all.
Result<void> read_file_list(const Payload& payload, const std::vector<std::filesystem::path>& files,
                            VoxelSink& sink, std::vector<std::string>& warnings);

// "12 x 10 x 5 x 20 voxels of i16 (24000 bytes)"
std::string describe(const Payload& payload);

// The numbers of a payload one after another, those of all frames, in native byte order.
class VoxelStream {
 public:
    // Checks that the file can hold what the payload claims; an error states both numbers.
    static Result<VoxelStream> open(const Payload& payload);

    // Whether the file can hold the claim, and how many bytes of the file count as its source.
    static Result<uint64_t> source_bytes(const Payload& payload);

    Result<void> read(std::span<std::byte> out);
    Result<void> skip(uint64_t bytes);
    // After the last number: warns of bytes that follow.
    Result<void> finish(std::vector<std::string>& warnings);

 private:
    explicit VoxelStream(const Payload& payload, ByteSource source)
        : payload_(payload), source_(std::move(source)) {}
    Result<void> read_text(std::span<std::byte> out);
    std::string_view next_word();
    tl::unexpected<Error> too_short(uint64_t found) const;

    Payload payload_;
    ByteSource source_;
    uint64_t done_ = 0, total_ = 0; // bytes
    std::string text_;              // of Encoding::ascii, whole
    size_t at_ = 0;                 // in it
};

} // namespace palpate::io
