#include "engine/net/blosc_chunk.h"

#include <tbb/parallel_for.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <optional>

#include "engine/base/assert.h"
#include "engine/net/bytes.h"

namespace palpate {

namespace {

constexpr size_t kHeaderBytes = 32;
constexpr size_t kBlockBytes = size_t{1} << 20; // of chunks that are written

// Bits of the byte of flags.
constexpr uint8_t kShuffled = 0x01, kCopied = 0x02, kBitShuffled = 0x04, kWhole = 0x10;
constexpr uint8_t kHasFilters = kShuffled | kBitShuffled; // both: the header has its second half
constexpr uint8_t kZstdFormat = 4;

enum class Special : uint8_t { none, zeros, not_a_number, value, left_alone };

struct Header {
    uint8_t flags;
    size_t sample_bytes, bytes, block_bytes;
    std::array<uint8_t, 6> filters;
    std::array<uint8_t, 6> filter_meta;
    Special special;
};

Result<Header> read_header(std::span<const std::byte> chunk, size_t expected) {
    if (chunk.size() < kHeaderBytes)
        return fail("expected a blosc2 chunk of at least {} bytes, found {}", kHeaderBytes,
                    chunk.size());
    const auto byte = [&](size_t at) { return std::to_integer<uint8_t>(chunk[at]); };
    Header h{};
    h.flags = byte(2);
    if (byte(0) < 3 || byte(0) > 6 || (h.flags & kHasFilters) != kHasFilters || byte(30) != 0)
        return fail(
            "expected a blosc2 chunk of version 3 to 6 with a list of filters, found "
            "version {} with flags {:#x} and {:#x}",
            byte(0), h.flags, byte(30));
    const auto bytes = number_at<int32_t>(chunk, 4);
    const auto block_bytes = number_at<int32_t>(chunk, 8);
    const auto chunk_bytes = number_at<int32_t>(chunk, 12);
    if (bytes < 0 || size_t(bytes) != expected)
        return fail("expected a blosc2 chunk that holds {} bytes, found {}", expected, bytes);
    if (chunk_bytes < 0 || size_t(chunk_bytes) != chunk.size())
        return fail("expected a blosc2 chunk of {} bytes, found {}", chunk_bytes, chunk.size());
    h.sample_bytes = byte(3);
    if (h.sample_bytes == 0 || block_bytes <= 0 || block_bytes > std::max(bytes, 1))
        return fail("expected a blosc2 chunk with blocks of 1 to {} bytes, found {}", bytes,
                    block_bytes);
    h.bytes = size_t(bytes);
    h.block_bytes = size_t(block_bytes);
    for (size_t i = 0; i < h.filters.size(); ++i) {
        h.filters[i] = byte(16 + i);
        h.filter_meta[i] = byte(24 + i);
    }
    const uint8_t flags = byte(31);
    const uint8_t special = (flags >> 4) & 7;
    if ((flags & 0x09) != 0 || special > uint8_t(Special::left_alone))
        return fail(
            "expected a blosc2 chunk without a dictionary and with its blocks, found flags "
            "{:#x}",
            flags);
    h.special = Special(special);
    return h;
}

// The chunk is one value, repeated.
Result<void> fill_special(const Header& h, std::span<const std::byte> chunk,
                          std::span<std::byte> out) {
    if (h.special == Special::not_a_number)
        return fail(
            "expected a blosc2 chunk of numbers, found one that is not a number throughout");
    std::fill(out.begin(), out.end(), std::byte{0}); // also what is left alone: no old memory
    if (h.special != Special::value)
        return {};
    const std::span<const std::byte> value = chunk.subspan(kHeaderBytes);
    if (value.empty() || out.size() % value.size() != 0)
        return fail("expected a blosc2 chunk of whole values of {} bytes, found {} bytes",
                    value.size(), out.size());
    for (size_t at = 0; at < out.size(); at += value.size())
        std::copy(value.begin(), value.end(), out.begin() + ptrdiff_t(at));
    return {};
}

// The bytes of one stream of a block, from `at` on, which goes to what follows.
Result<void> read_stream(std::span<const std::byte> chunk, size_t& at, std::span<std::byte> out) {
    if (at > chunk.size() || chunk.size() - at < 4)
        return fail("expected a stream of a blosc2 block at byte {}, found the end at {}", at,
                    chunk.size());
    const auto length = number_at<int32_t>(chunk, at);
    at += 4;
    if (length <= 0) { // a run of one byte
        if (length < 0) {
            if (length < -255 || at == chunk.size() || chunk[at] != std::byte{1})
                return fail("expected a run of a byte in a blosc2 block, found length {}", length);
            ++at;
        }
        std::fill(out.begin(), out.end(), std::byte(uint8_t(-length)));
        return {};
    }
    if (size_t(length) > chunk.size() - at)
        return fail("expected a stream of {} bytes in a blosc2 block, found {}", length,
                    chunk.size() - at);
    const std::span<const std::byte> stream = chunk.subspan(at, size_t(length));
    at += size_t(length);
    if (stream.size() == out.size()) {
        std::copy(stream.begin(), stream.end(), out.begin());
        return {};
    }
    const size_t made = ZSTD_decompress(out.data(), out.size(), stream.data(), stream.size());
    if (ZSTD_isError(made))
        return fail("expected a zstd stream of {} bytes, found damage ({})", out.size(),
                    ZSTD_getErrorName(made));
    if (made != out.size())
        return fail("expected a zstd stream of {} bytes, found {}", out.size(), made);
    return {};
}

// All first bytes of samples, then all second ones, ..; what is no whole sample stays at the end.
void shuffle(std::span<const std::byte> in, size_t sample_bytes, std::span<std::byte> out) {
    const size_t count = in.size() / sample_bytes;
    for (size_t i = 0; i < count; ++i)
        for (size_t j = 0; j < sample_bytes; ++j)
            out[j * count + i] = in[i * sample_bytes + j];
    const auto rest = ptrdiff_t(count * sample_bytes);
    std::copy(in.begin() + rest, in.end(), out.begin() + rest);
}

void unshuffle(std::span<const std::byte> in, size_t sample_bytes, std::span<std::byte> out) {
    const size_t count = in.size() / sample_bytes;
    for (size_t j = 0; j < sample_bytes; ++j)
        for (size_t i = 0; i < count; ++i)
            out[i * sample_bytes + j] = in[j * count + i];
    const auto rest = ptrdiff_t(count * sample_bytes);
    std::copy(in.begin() + rest, in.end(), out.begin() + rest);
}

// The sizes of samples by which bytes were shuffled, in the order in which that is undone.
Result<std::vector<size_t>> shuffles_of(const Header& h) {
    std::vector<size_t> sizes;
    for (size_t i = h.filters.size(); i-- > 0;) {
        const uint8_t filter = h.filters[i];
        if (filter == 1)
            sizes.push_back(h.filter_meta[i] ? h.filter_meta[i] : h.sample_bytes);
        else if (filter != 0 && filter != 4) // 4 has cut digits off, which cannot be undone
            return fail("expected a blosc2 chunk with bytes shuffled or not, found filter {}",
                        filter);
    }
    return sizes;
}

Result<void> read_block(const Header& h, std::span<const std::byte> chunk, size_t start,
                        std::span<std::byte> out) {
    const bool is_split = !(h.flags & kWhole) && out.size() == h.block_bytes;
    const size_t streams = is_split ? h.sample_bytes : 1;
    if (out.size() % streams != 0 || out.size() < streams)
        return fail("expected a blosc2 block of whole samples of {} bytes, found {} bytes", streams,
                    out.size());
    const size_t each = out.size() / streams;
    for (size_t i = 0; i < streams; ++i)
        PALPATE_TRY(read_stream(chunk, start, out.subspan(i * each, each)));
    return {};
}

// One block of a chunk that is written: its length and its stream.
std::vector<std::byte> packed_block(std::span<const std::byte> block, size_t sample_bytes) {
    std::vector<std::byte> packed;
    if (std::all_of(block.begin(), block.end(), [](std::byte b) { return b == std::byte{0}; })) {
        append_number(packed, int32_t{0});
        return packed;
    }
    std::vector<std::byte> shuffled;
    if (sample_bytes > 1) {
        shuffled.resize(block.size());
        shuffle(block, sample_bytes, shuffled);
        block = shuffled;
    }
    packed.resize(4 + ZSTD_compressBound(block.size()));
    size_t length = ZSTD_compress(packed.data() + 4, packed.size() - 4, block.data(), block.size(),
                                  /*level=*/3);
    if (ZSTD_isError(length) || length >= block.size()) { // a stream as long as its block is plain
        length = block.size();
        std::copy(block.begin(), block.end(), packed.begin() + 4);
    }
    packed.resize(4 + length);
    const auto stored = int32_t(length);
    std::memcpy(packed.data(), &stored, sizeof stored);
    return packed;
}

} // namespace

Result<void> read_blosc_chunk(std::span<const std::byte> chunk, std::span<std::byte> out) {
    PALPATE_TRY(const Header h, read_header(chunk, out.size()));
    if (h.special != Special::none)
        return fill_special(h, chunk, out);
    if (h.flags & kCopied) {
        if (chunk.size() - kHeaderBytes != out.size())
            return fail("expected {} plain bytes in a blosc2 chunk, found {}", out.size(),
                        chunk.size() - kHeaderBytes);
        std::copy(chunk.begin() + kHeaderBytes, chunk.end(), out.begin());
        return {};
    }
    if (h.flags >> 5 != kZstdFormat)
        return fail("expected a blosc2 chunk compressed by zstd (codec 4), found codec {}",
                    h.flags >> 5);
    PALPATE_TRY(const std::vector<size_t> shuffles, shuffles_of(h));
    const size_t blocks = (out.size() + h.block_bytes - 1) / h.block_bytes;
    if ((chunk.size() - kHeaderBytes) / 4 < blocks)
        return fail("expected the places of {} blosc2 blocks, found {} bytes", blocks,
                    chunk.size() - kHeaderBytes);
    std::vector<std::byte> shuffled(shuffles.empty() ? 0 : h.block_bytes);
    for (size_t i = 0; i < blocks; ++i) {
        const auto start = number_at<int32_t>(chunk, kHeaderBytes + 4 * i);
        if (start < 0)
            return fail("expected a place in a blosc2 chunk, found {}", start);
        const auto block =
            out.subspan(i * h.block_bytes, std::min(h.block_bytes, out.size() - i * h.block_bytes));
        PALPATE_TRY(read_block(h, chunk, size_t(start), block));
        for (const size_t sample_bytes : shuffles) {
            std::copy(block.begin(), block.end(), shuffled.begin());
            unshuffle(std::span(shuffled).first(block.size()), sample_bytes, block);
        }
    }
    return {};
}

std::vector<std::byte> write_blosc_chunk(std::span<const std::byte> samples, size_t sample_bytes) {
    PALPATE_ASSERT(samples.size() <= kLargestBloscChunk);
    PALPATE_ASSERT(sample_bytes >= 1 && sample_bytes <= 255);
    const size_t block_bytes =
        std::clamp<size_t>(samples.size(), 1, kBlockBytes / sample_bytes * sample_bytes);
    const size_t count = (samples.size() + block_bytes - 1) / block_bytes;
    std::vector<std::vector<std::byte>> blocks(count);
    tbb::parallel_for(size_t{0}, count, [&](size_t i) {
        const size_t start = i * block_bytes;
        blocks[i] = packed_block(
            samples.subspan(start, std::min(block_bytes, samples.size() - start)), sample_bytes);
    });
    size_t total = kHeaderBytes + 4 * count;
    for (const auto& block : blocks)
        total += block.size();
    std::vector<std::byte> chunk;
    chunk.reserve(total);
    for (const uint8_t byte :
         {uint8_t{5}, uint8_t{1}, uint8_t(kHasFilters | kWhole | kZstdFormat << 5),
          uint8_t(sample_bytes)})
        chunk.push_back(std::byte(byte));
    append_number(chunk, int32_t(samples.size()));
    append_number(chunk, int32_t(block_bytes));
    append_number(chunk, int32_t(total));
    chunk.resize(kHeaderBytes); // no filters, no codec of others, no flags
    if (sample_bytes > 1)
        chunk[21] = std::byte{1}; // the last filter: shuffle
    size_t place = kHeaderBytes + 4 * count;
    for (const auto& block : blocks) {
        append_number(chunk, int32_t(place));
        place += block.size();
    }
    for (const auto& block : blocks)
        chunk.insert(chunk.end(), block.begin(), block.end());
    return chunk;
}

} // namespace palpate
