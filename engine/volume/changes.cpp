#include "engine/volume/changes.h"

#include <algorithm>
#include <tuple>

#include "engine/base/assert.h"

namespace palpate {

std::vector<ChangedBrick> changed_bricks(const Volume& before, const Volume& after) {
    PALPATE_ASSERT(before.size() == after.size() && before.type() == after.type());
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
            if (const uint64_t blocks = differing_blocks(*was, *is))
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
