#include "engine/io/brick_file_layout.h"

#include <zlib.h>
#include <zstd.h>

#include <bit>
#include <cstring>
#include <limits>
#include <memory>

#include "engine/base/assert.h"

namespace palpate::io {

static_assert(std::endian::native == std::endian::little);

namespace {

// Measured on the phantom and a head CT: level 3 takes 1.6 times as long as level 1 for 1 % less.
constexpr int kLevel = 1;

struct FreeContext {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

template <class T>
ValueRange stored_range(T low, T high) {
    return low > high ? ValueRange{}
                      : ValueRange{static_cast<float>(low), static_cast<float>(high)};
}

} // namespace

uint32_t checksum(std::span<const std::byte> bytes) {
    return static_cast<uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

size_t packed_bound(ScalarType type) {
    return ZSTD_compressBound(kBrickSamples * bytes_per_sample(type));
}

void pack_brick(const Brick& brick, std::vector<std::byte>& planes, std::vector<std::byte>& out) {
    thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
    const size_t width = bytes_per_sample(brick.type());
    const Brick::Pinned pinned = brick.pin();
    PALPATE_ASSERT(!brick.is_constant());
    planes.resize(kBrickSamples * width);
    for (size_t byte = 0; byte < width; ++byte)
        for (size_t i = 0; i < kBrickSamples; ++i)
            planes[byte * kBrickSamples + i] = pinned.bytes[i * width + byte];
    out.resize(packed_bound(brick.type()));
    const size_t packed = ZSTD_compressCCtx(context.get(), out.data(), out.size(), planes.data(),
                                            planes.size(), kLevel);
    PALPATE_ASSERT(!ZSTD_isError(packed)); // the bound suffices
    out.resize(packed);
}

Result<void> unpack_brick(std::span<const std::byte> packed, ScalarType type,
                          std::span<std::byte> out) {
    thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
    thread_local std::vector<std::byte> planes;
    const size_t width = bytes_per_sample(type);
    PALPATE_ASSERT_CMP(out.size(), ==, kBrickSamples * width);
    planes.resize(out.size());
    const size_t got = ZSTD_decompressDCtx(context.get(), planes.data(), planes.size(),
                                           packed.data(), packed.size());
    if (ZSTD_isError(got))
        return fail("cannot be unpacked: {}", ZSTD_getErrorName(got));
    if (got != out.size())
        return fail("expected {} bytes, found {}", out.size(), got);
    for (size_t byte = 0; byte < width; ++byte)
        for (size_t i = 0; i < kBrickSamples; ++i)
            out[i * width + byte] = planes[byte * kBrickSamples + i];
    return {};
}

void append_ranges(const Brick& brick, std::vector<std::byte>& out) {
    visit_scalar(brick.type(), [&](auto t) {
        using T = decltype(t);
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block) {
            const ValueRange range = brick.block_range(block);
            using Limits = std::numeric_limits<T>;
            const T ends[2] = {range.empty() ? Limits::max() : static_cast<T>(range.min),
                               range.empty() ? Limits::lowest() : static_cast<T>(range.max)};
            const auto bytes = std::as_bytes(std::span(ends));
            out.insert(out.end(), bytes.begin(), bytes.end());
        }
    });
}

void read_ranges(std::span<const std::byte> table, ScalarType type, BlockRanges& ranges) {
    PALPATE_ASSERT_CMP(table.size(), ==, range_table_bytes(type));
    visit_scalar(type, [&](auto t) {
        using T = decltype(t);
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block) {
            T ends[2];
            std::memcpy(ends, table.data() + block * sizeof ends, sizeof ends);
            ranges[block] = stored_range(ends[0], ends[1]);
        }
    });
}

} // namespace palpate::io
