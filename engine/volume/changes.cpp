#include "engine/volume/changes.h"

#include <algorithm>
#include <tuple>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// The blocks of two bricks of different types in which a value differs.
uint64_t blocks_of_other_values(const Brick& a, const Brick& b) {
    const auto same = [](float x, float y) { return x == y || (x != x && y != y); };
    if (a.is_constant() && b.is_constant())
        return same(a.value(0), b.value(0)) ? 0 : ~uint64_t{0};
    std::vector<float> values_a(kBrickSamples), values_b(kBrickSamples);
    a.read(std::span(values_a));
    b.read(std::span(values_b));
    uint64_t blocks = 0;
    for (uint32_t i = 0; i < kBrickSamples; ++i)
        if (!same(values_a[i], values_b[i]))
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
