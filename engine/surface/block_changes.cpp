#include "engine/surface/block_changes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <tuple>

#include "engine/surface/block_cells.h"

namespace palpate::block {

namespace {

constexpr int kBlocksInBrick = static_cast<int>(kBlocksPerSide);

// Which samples of a block differ: bit x of row[z][y].
using Differences = std::array<std::array<uint8_t, kSide>, kSide>;

template <class T>
Differences differences(const Brick& before, const Brick& after, glm::ivec3 block) {
    const BrickSamples<T> a = before.samples<T>(), b = after.samples<T>();
    Differences differ{};
    for (int z = 0; z < kSide; ++z)
        for (int y = 0; y < kSide; ++y) {
            const uint32_t at = offset_in_brick(glm::uvec3(block * kSide + glm::ivec3(0, y, z)));
            for (uint32_t x = 0; x < kSide; ++x) {
                const T was = a[before.stride() * (at + x)], is = b[after.stride() * (at + x)];
                differ[z][y] |= static_cast<uint8_t>((std::memcmp(&was, &is, sizeof(T)) != 0) << x);
            }
        }
    return differ;
}

// Bit n, for the neighbour at (n % 3, n / 3 % 3, n / 9) - 1: it reads a sample that differs. The
// one before reads `head` first samples of the block, the one after its last `tail` ones.
uint32_t readers(const Differences& differ, int head, int tail) {
    const auto in_class = [&](int neighbour, int i) { // does it read sample i of the block?
        return neighbour == 1 || (neighbour == 0 ? i < head : i >= kSide - tail);
    };
    std::array<uint8_t, 9> rows{}; // of the neighbours in y and z
    for (int z = 0; z < kSide; ++z)
        for (int y = 0; y < kSide; ++y)
            if (differ[z][y] != 0)
                for (int n = 0; n < 9; ++n)
                    if (in_class(n % 3, y) && in_class(n / 3, z))
                        rows[n] |= differ[z][y];
    const auto first = static_cast<uint8_t>((1 << head) - 1);
    const auto final = static_cast<uint8_t>(0xff00 >> tail);
    uint32_t found = 0;
    for (int n = 0; n < 9; ++n) {
        found |= static_cast<uint32_t>((rows[n] & first) != 0) << (3 * n);
        found |= static_cast<uint32_t>(rows[n] != 0) << (3 * n + 1);
        found |= static_cast<uint32_t>((rows[n] & final) != 0) << (3 * n + 2);
    }
    return found;
}

} // namespace

glm::ivec3 block_in_brick(int number) {
    return {number % kBlocksInBrick, number / kBlocksInBrick % kBlocksInBrick,
            number / (kBlocksInBrick * kBlocksInBrick)};
}

std::vector<glm::ivec3> blocks_that_read(const Volume& before, const Volume& after,
                                         std::span<const ChangedBrick> changed,
                                         const SurfaceOptions& options, glm::ivec3 first,
                                         glm::ivec3 end) {
    const bool gradient = options.normals == SurfaceNormals::gradient;
    const int head = gradient ? 2 : 1, tail = gradient ? 1 : 0;
    std::vector<glm::ivec3> blocks;
    for (const ChangedBrick& brick : changed) {
        const Brick& was = before.brick(brick.position);
        const Brick& is = after.brick(brick.position);
        for (uint64_t left = brick.blocks; left != 0; left &= left - 1) {
            const glm::ivec3 local = block_in_brick(std::countr_zero(left));
            const Differences differ = visit_scalar(
                is.type(), [&](auto t) { return differences<decltype(t)>(was, is, local); });
            const glm::ivec3 at = glm::ivec3(brick.position) * kBlocksInBrick + local;
            for (uint32_t n = readers(differ, head, tail); n != 0; n &= n - 1) {
                const int i = std::countr_zero(n);
                const glm::ivec3 reader = at + glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1;
                if (glm::all(glm::greaterThanEqual(reader, first)) &&
                    glm::all(glm::lessThan(reader, end)))
                    blocks.push_back(reader);
            }
        }
    }
    std::sort(blocks.begin(), blocks.end(), [](glm::ivec3 a, glm::ivec3 b) {
        return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
    });
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    return blocks;
}

bool is_on_one_side(const Volume& volume, float iso, glm::ivec3 block) {
    const glm::ivec3 last = (glm::ivec3(volume.size()) - 1) / kSide;
    ValueRange range;
    bool gaps = false, data = false;
    for (int n = 0; n < 8; ++n) {
        const glm::ivec3 at = block + glm::ivec3(n & 1, n >> 1 & 1, n >> 2);
        if (glm::any(glm::greaterThan(at, last)))
            continue;
        const Brick& brick = volume.brick(glm::uvec3(at / kBlocksInBrick));
        const ValueRange of_block =
            brick.block_range(block_of(glm::uvec3(at % kBlocksInBrick * kSide)));
        gaps = gaps || brick.no_data_count() > 0;
        data = data || !of_block.empty();
        range.include(of_block);
    }
    return !data || !(range.max >= iso) || (range.min >= iso && !gaps);
}

} // namespace palpate::block
