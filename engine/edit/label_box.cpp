#include "engine/edit/label_box.h"

#include <tbb/parallel_for.h>

#include "engine/volume/box.h"
#include "engine/volume/builder.h"

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

Volume as_u16_labels(const Volume& labels) {
    if (labels.type() == ScalarType::u16)
        return labels;
    VolumeBuilder builder(labels.grid(), ScalarType::u16);
    const glm::uvec3 count = labels.brick_count();
    const size_t total = size_t{count.x} * count.y * count.z;
    tbb::parallel_for(size_t{0}, total, [&](size_t i) {
        const glm::uvec3 at(i % count.x, i / count.x % count.y, i / (size_t{count.x} * count.y));
        const Brick& brick = labels.brick(at);
        if (brick.is_constant() && brick.value(0) == 0.0f)
            return; // as those that are never set
        std::vector<uint16_t> samples(brick.is_constant() ? 1 : kBrickSamples);
        if (brick.is_constant())
            samples[0] = static_cast<uint16_t>(brick.value(0));
        else
            brick.read(std::span(samples));
        builder.set_brick(
            at, Brick::make(std::span<const uint16_t>(samples), labels.valid_in_brick(at)));
    });
    return builder.finish();
}

} // namespace palpate
