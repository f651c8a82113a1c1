#include "engine/edit/step.h"

#include <zstd.h>

#include <bit>
#include <cstring>

#include "engine/volume/brick_source.h"

namespace palpate {

namespace {

constexpr int kLevel = 3; // of zstd: 1 packs labels 1.5 times worse, 9 is 5 times slower
constexpr size_t kBlockRows = kBlockSide * kBlockSide;

struct BrickHeader {
    uint32_t x, y, z, pad;
    uint64_t blocks;
};

// Calls visit(offset of its first sample) for the 64 rows of a block.
template <class Visit>
void for_each_block_row(uint32_t block, Visit&& visit) {
    const glm::uvec3 first =
        kBlockSide * glm::uvec3(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                block / (kBlocksPerSide * kBlocksPerSide));
    for (uint32_t row = 0; row < kBlockRows; ++row)
        visit(offset_in_brick(first + glm::uvec3(0, row % kBlockSide, row / kBlockSide)));
}

std::vector<std::byte> expanded(const Brick& brick) {
    std::vector<std::byte> bytes(kBrickSamples * bytes_per_sample(brick.type()));
    visit_scalar(brick.type(), [&](auto t) {
        using T = decltype(t);
        brick.read(std::span<T>(reinterpret_cast<T*>(bytes.data()), kBrickSamples));
    });
    return bytes;
}

// All that may have changed, told without reading a sample.
std::vector<ChangedBrick> unshared_bricks(const Volume& before, const Volume& after) {
    std::vector<ChangedBrick> bricks;
    for_each_brick(before, [&](glm::uvec3 at) {
        if (before.brick_ptr(at) != after.brick_ptr(at))
            bricks.push_back({at, ~uint64_t{0}});
    });
    return bricks;
}

} // namespace

std::vector<ReplacedBrick> replaced_bricks(const Volume& before, const Volume& after) {
    std::vector<ChangedBrick> all;
    try {
        all = changed_bricks(before, after);
    } catch (const SourceError&) { // samples cannot be compared any more
        all = unshared_bricks(before, after);
    }
    std::vector<ReplacedBrick> bricks;
    for (const ChangedBrick& changed : all)
        bricks.push_back(
            {changed, before.brick_ptr(changed.position), after.brick_ptr(changed.position)});
    return bricks;
}

Volume taken_back(const Volume& before, const Volume& after) {
    std::vector<PlacedBrick> bricks;
    for (const ChangedBrick& brick : unshared_bricks(before, after))
        bricks.push_back({brick.position, before.brick_ptr(brick.position)});
    return with_bricks(after, bricks);
}

std::vector<std::byte> pack_step(const Volume& of, std::span<const ReplacedBrick> bricks) {
    const size_t sample = bytes_per_sample(of.type()), row_bytes = kBlockSide * sample;
    std::vector<std::byte> plain;
    const auto append = [&](const void* from, size_t bytes) {
        const auto* first = static_cast<const std::byte*>(from);
        plain.insert(plain.end(), first, first + bytes);
    };
    for (const ReplacedBrick& brick : bricks) {
        const glm::uvec3 at = brick.where.position;
        const BrickHeader header{at.x, at.y, at.z, 0, brick.where.blocks};
        append(&header, sizeof header);
        const std::vector<std::byte> a = expanded(*brick.before), b = expanded(*brick.after);
        for (uint64_t left = header.blocks; left != 0; left &= left - 1)
            for_each_block_row(static_cast<uint32_t>(std::countr_zero(left)), [&](uint32_t row) {
                for (size_t i = row * sample; i < row * sample + row_bytes; ++i)
                    plain.push_back(a[i] ^ b[i]);
            });
    }
    std::vector<std::byte> packed(ZSTD_compressBound(plain.size()));
    const size_t bytes =
        ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), kLevel);
    packed.resize(ZSTD_isError(bytes) ? 0 : bytes);
    packed.shrink_to_fit();
    return packed;
}

Result<Volume> apply_packed_step(const Volume& now, std::span<const std::byte> packed) {
    const auto damaged = [] { return fail("history: a step is damaged and cannot be taken"); };
    const size_t sample = bytes_per_sample(now.type()), row_bytes = kBlockSide * sample;
    const glm::uvec3 count = now.brick_count();
    const uint64_t most =
        (sizeof(BrickHeader) + kBrickSamples * sample) * uint64_t{count.x} * count.y * count.z;
    const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN || size > most)
        return damaged();
    std::vector<std::byte> plain(size);
    if (ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size()) != size)
        return damaged();
    std::vector<PlacedBrick> made;
    for (size_t at = 0; at < plain.size();) {
        BrickHeader header;
        if (plain.size() - at < sizeof header)
            return damaged();
        std::memcpy(&header, plain.data() + at, sizeof header);
        at += sizeof header;
        const glm::uvec3 position(header.x, header.y, header.z);
        const size_t bytes = size_t(std::popcount(header.blocks)) * kBlockRows * row_bytes;
        if (!glm::all(glm::lessThan(position, count)) || plain.size() - at < bytes)
            return damaged();
        std::vector<std::byte> samples = expanded(now.brick(position));
        for (uint64_t left = header.blocks; left != 0; left &= left - 1)
            for_each_block_row(static_cast<uint32_t>(std::countr_zero(left)), [&](uint32_t row) {
                for (size_t i = row * sample; i < row * sample + row_bytes; ++i)
                    samples[i] ^= plain[at++];
            });
        made.push_back(
            {position, visit_scalar(now.type(), [&](auto t) {
                 using T = decltype(t);
                 return Brick::make(
                     std::span<const T>(reinterpret_cast<const T*>(samples.data()), kBrickSamples),
                     now.valid_in_brick(position));
             })});
    }
    return with_bricks(now, made);
}

} // namespace palpate
