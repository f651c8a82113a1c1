#include "engine/edit/label_box.h"

#include <algorithm>

namespace palpate {

LabelBox read_labels(const Volume& volume, glm::ivec3 low, glm::ivec3 high) {
    LabelBox box{low, high - low + 1, {}};
    box.values.assign(size_t(box.size.x) * box.size.y * box.size.z, -1);
    const glm::ivec3 first = glm::max(low, glm::ivec3(0));
    const glm::ivec3 last = glm::min(high, glm::ivec3(volume.size()) - 1);
    const int side = kBrickSide;
    const glm::ivec3 first_brick = first / side, last_brick = last / side;
    for (int bz = first_brick.z; bz <= last_brick.z; ++bz)
        for (int by = first_brick.y; by <= last_brick.y; ++by)
            for (int bx = first_brick.x; bx <= last_brick.x; ++bx) {
                const glm::ivec3 origin = glm::ivec3(bx, by, bz) * side;
                const glm::ivec3 from = glm::max(first, origin);
                const glm::ivec3 to = glm::min(last, origin + side - 1);
                const Brick& brick = volume.brick(glm::uvec3(bx, by, bz));
                visit_scalar(brick.type(), [&](auto t) {
                    const auto samples = brick.samples<decltype(t)>();
                    for (int z = from.z; z <= to.z; ++z)
                        for (int y = from.y; y <= to.y; ++y) {
                            int32_t* out = box.row(y - low.y, z - low.z) - low.x;
                            const uint32_t row =
                                offset_in_brick(glm::uvec3(0, y - origin.y, z - origin.z));
                            for (int x = from.x; x <= to.x; ++x)
                                out[x] = static_cast<int32_t>(
                                    samples[brick.stride() * (row + (x - origin.x))]);
                        }
                });
            }
    return box;
}

} // namespace palpate
