#include "engine/volume/volume.h"

#include <unordered_set>

#include "engine/volume/box.h"

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
    read_box(volume, glm::ivec3(start), {count, 1, 1}, {}, out);
}

} // namespace palpate
