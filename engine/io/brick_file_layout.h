#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/brick.h"
#include "engine/volume/grid.h"

// The bytes of a brick file (docs/reference/brick-file.md): header, packed bricks, index. All
// numbers are little-endian.
namespace palpate::io {

constexpr char kBrickFileMagic[8] = {'\x89', 'P', 'B', 'V', '\r', '\n', '\x1a', '\n'};
constexpr uint32_t kBrickFileVersion = 1;
constexpr uint32_t kBrickFileLabels = 1; // BrickFileHeader::flags

struct BrickFileHeader {
    char magic[8];
    uint32_t version;
    uint32_t header_bytes; // 256
    uint64_t file_bytes;
    uint64_t index_offset;
    uint64_t index_bytes;
    uint64_t range_count; // tables of block ranges in the index
    uint32_t size[3];     // samples
    uint32_t type;        // ScalarType
    uint32_t flags;
    uint32_t level_count;
    double world_from_index[16]; // column by column, LPS millimetres
    char modality[32];           // ends with zeros
    uint32_t index_crc;
    uint32_t reserved[4]; // 0
    uint32_t header_crc;  // of all bytes before it
};
static_assert(sizeof(BrickFileHeader) == 256);

// One brick of the index. Levels follow one another, finest first; bricks within a level x fastest.
struct BrickFileEntry {
    uint64_t offset; // from the start of the file; of a constant brick, its value's bytes
    uint32_t bytes;  // packed; 0 for a constant brick
    uint32_t crc;    // CRC-32 of the packed bytes
    uint32_t no_data;
    uint32_t ranges; // number of its table of block ranges; 0 for a constant brick
};
static_assert(sizeof(BrickFileEntry) == 24);

// CRC-32 of zlib. It tells every single damaged byte, and every damaged run of up to 32 bits.
uint32_t checksum(std::span<const std::byte> bytes);

// Packs a brick's 32768 samples: first all lowest bytes of the samples, then all second ones and so
// on, as one zstd frame of level 1. `planes` is scratch.
void pack_brick(const Brick& brick, std::vector<std::byte>& planes, std::vector<std::byte>& out);

// The most bytes that packing may take.
size_t packed_bound(ScalarType type);

// The reverse; an error says what is wrong with the packed bytes, without naming the file.
// `out` holds kBrickSamples samples.
Result<void> unpack_brick(std::span<const std::byte> packed, ScalarType type,
                          std::span<std::byte> out);

// Tables of block ranges: lowest and highest of each block in the type of the samples; lowest >
// highest where a block has no sample with data.
constexpr size_t range_table_bytes(ScalarType type) {
    return 2 * kBlocksPerBrick * bytes_per_sample(type);
}
void append_ranges(const Brick& brick, std::vector<std::byte>& out);
void read_ranges(std::span<const std::byte> table, ScalarType type, BlockRanges& ranges);

} // namespace palpate::io
