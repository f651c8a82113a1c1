#include "engine/volume/changes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <tuple>

#include "engine/base/assert.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

bool is_same(float x, float y) {
    return x == y || (x != x && y != y);
}

// The blocks of two bricks of different types in which a value differs.
uint64_t blocks_of_other_values(const Brick& a, const Brick& b) {
    if (a.is_constant() && b.is_constant())
        return is_same(a.value(0), b.value(0)) ? 0 : ~uint64_t{0};
    std::vector<float> values_a(kBrickSamples), values_b(kBrickSamples);
    a.read(std::span(values_a));
    b.read(std::span(values_b));
    uint64_t blocks = 0;
    for (uint32_t i = 0; i < kBrickSamples; ++i)
        if (!is_same(values_a[i], values_b[i]))
            blocks |= uint64_t{1} << block_of({i % kBrickSide, i / kBrickSide % kBrickSide,
                                               i / (kBrickSide * kBrickSide)});
    return blocks;
}

} // namespace

std::vector<ChangedBrick> changed_bricks(const Volume& before, const Volume& after) {
    PALPATE_ASSERT(before.size() == after.size());
    const bool same_type = before.type() == after.type();
    std::vector<ChangedBrick> changed;
    const Volume::Root& a = before.root();
    const Volume::Root& b = after.root();
    for (size_t p = 0; p < a.pages.size(); ++p) {
        if (a.pages[p] == b.pages[p])
            continue;
        const glm::uvec3 page(p % a.page_count.x, p / a.page_count.x % a.page_count.y,
                              p / (size_t{a.page_count.x} * a.page_count.y));
        for (uint32_t s = 0; s < kBricksPerPage; ++s) {
            const BrickPtr& was = a.pages[p]->bricks[s];
            const BrickPtr& is = b.pages[p]->bricks[s];
            if (was == is)
                continue;
            const glm::uvec3 slot(s % kPageSide, s / kPageSide % kPageSide,
                                  s / (kPageSide * kPageSide));
            if (const uint64_t blocks =
                    same_type ? differing_blocks(*was, *is) : blocks_of_other_values(*was, *is))
                changed.push_back({page * kPageSide + slot, blocks});
        }
    }
    std::sort(changed.begin(), changed.end(), [](const ChangedBrick& x, const ChangedBrick& y) {
        return std::tie(x.position.z, x.position.y, x.position.x) <
               std::tie(y.position.z, y.position.y, y.position.x);
    });
    return changed;
}

std::vector<ChangedBox> changed_boxes(const Volume& before, const Volume& after,
                                      const ChangedBrick& brick) {
    constexpr int kSide = int{kBlockSide};
    std::vector<ChangedBox> boxes;
    std::array<float, kSide * kSide * kSide> was, is; // each holds all values of each type
    for (uint64_t left = brick.blocks; left != 0; left &= left - 1) {
        const auto block = static_cast<uint32_t>(std::countr_zero(left));
        const glm::uvec3 in_brick(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                  block / (kBlocksPerSide * kBlocksPerSide));
        const glm::ivec3 first(brick.position * kBrickSide + in_brick * kBlockSide);
        if (!glm::all(glm::lessThan(first, glm::ivec3(after.size())))) // padding
            continue;
        const glm::ivec3 size = glm::min(glm::ivec3(kSide), glm::ivec3(after.size()) - first);
        read_box(before, first, size, {kSide, kSide * kSide}, was.data());
        read_box(after, first, size, {kSide, kSide * kSide}, is.data());
        ChangedBox box{glm::ivec3(kSide), glm::ivec3(-1)};
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x) {
                    const auto i = static_cast<size_t>(x + kSide * (y + kSide * z));
                    if (is_same(was[i], is[i]))
                        continue;
                    box.first = glm::min(box.first, glm::ivec3(x, y, z));
                    box.last = glm::max(box.last, glm::ivec3(x, y, z));
                }
        if (box.last.x >= 0)
            boxes.push_back({first + box.first, first + box.last});
    }
    return boxes;
}

BrickBox changed_samples(const ChangedBrick& brick) {
    glm::uvec3 low(kBlocksPerSide), high(0);
    for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
        if (brick.blocks >> block & 1) {
            const glm::uvec3 at(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                block / (kBlocksPerSide * kBlocksPerSide));
            low = glm::min(low, at);
            high = glm::max(high, at + 1u);
        }
    return {low * kBlockSide, high * kBlockSide};
}

} // namespace palpate
