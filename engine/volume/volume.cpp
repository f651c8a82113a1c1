#include "engine/volume/volume.h"

#include <unordered_set>

namespace palpate {

size_t Volume::bytes() const {
    std::unordered_set<const void*> seen;
    size_t total = sizeof(Root) + root_->pages.size() * sizeof(root_->pages[0]);
    for (const auto& page : root_->pages) {
        if (!seen.insert(page.get()).second)
            continue;
        total += sizeof(Page);
        for (const BrickPtr& brick : page->bricks)
            if (brick && seen.insert(brick.get()).second)
                total += brick->bytes();
    }
    return total;
}

void read_row(const Volume& volume, glm::uvec3 start, uint32_t count, float* out) {
    for (uint32_t x = start.x; x < start.x + count;) {
        const Brick& brick = volume.brick(glm::uvec3(x, start.y, start.z) / kBrickSide);
        const uint32_t in_brick = x % kBrickSide;
        const uint32_t n = std::min(kBrickSide - in_brick, start.x + count - x);
        const uint32_t offset =
            offset_in_brick({in_brick, start.y % kBrickSide, start.z % kBrickSide});
        visit_scalar(brick.type(), [&](auto t) {
            const auto samples = brick.samples<decltype(t)>();
            for (uint32_t i = 0; i < n; ++i)
                out[i] = static_cast<float>(samples[brick.stride() * (offset + i)]);
        });
        out += n;
        x += n;
    }
}

} // namespace palpate
