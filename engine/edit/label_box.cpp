#include "engine/edit/label_box.h"

#include "engine/volume/box.h"

namespace palpate {

LabelBox read_labels(const Volume& volume, glm::ivec3 low, glm::ivec3 high) {
    LabelBox box{low, high - low + 1, {}};
    box.values.assign(size_t(box.size.x) * box.size.y * box.size.z, -1);
    const glm::ivec3 first = glm::max(low, glm::ivec3(0));
    const glm::ivec3 last = glm::min(high, glm::ivec3(volume.size()) - 1);
    if (glm::all(glm::lessThanEqual(first, last)))
        read_box(volume, first, last - first + 1, packed(glm::uvec3(box.size)),
                 &box.values[box.at(first)]);
    return box;
}

} // namespace palpate
