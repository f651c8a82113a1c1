#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/base/error.h"

// Chunks of blosc2, as nnInteractive's arrays hold them (README_CHUNK_FORMAT of c-blosc2, versions
// 3 to 6 of the format): a header of 32 bytes, the places of blocks, and blocks that are zstd
// streams, whole or split by the bytes of a sample, with the bytes of samples shuffled or not.
namespace palpate {

constexpr size_t kLargestBloscChunk = size_t{1} << 30; // bytes before compression

// Fills `out`, whose size is what the chunk must hold. Every length of the chunk is checked before
// it is used, and no more than another block of memory is taken. Refused, in a sentence without a
// subject ("expected .., found .."): damaged chunks, chunks of another size, other codecs than
// zstd, other filters than shuffle, dictionaries, and chunks without the header's second half.
// After a failure `out` holds anything.
Result<void> read_blosc_chunk(std::span<const std::byte> chunk, std::span<std::byte> out);

// A chunk that holds `samples` of `sample_bytes` each, at most kLargestBloscChunk bytes. Threaded.
std::vector<std::byte> write_blosc_chunk(std::span<const std::byte> samples, size_t sample_bytes);

} // namespace palpate
