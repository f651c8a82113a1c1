#pragma once

#include <vector>

#include "engine/volume/builder.h"
#include "engine/volume/pyramid.h"

namespace palpate {

// The whole next level at once: the twin of what the writer of brick files makes piece by piece.
inline Volume coarser_volume(const Volume& volume, Reduction reduction) {
    VolumeBuilder builder(coarser_grid(volume.grid()), volume.type());
    const glm::uvec3 size = (volume.size() + 1u) / 2u, bricks = builder.brick_count();
    for (uint32_t i = 0; i < bricks.x * bricks.y * bricks.z; ++i) {
        const glm::uvec3 position(i % bricks.x, i / bricks.x % bricks.y, i / (bricks.x * bricks.y));
        const glm::uvec3 valid = glm::min(glm::uvec3(kBrickSide), size - position * kBrickSide);
        visit_scalar(volume.type(), [&](auto t) {
            using T = decltype(t);
            std::vector<T> samples(kBrickSamples);
            for (uint32_t octant = 0; octant < 8; ++octant) {
                const glm::uvec3 fine =
                    2u * position + glm::uvec3(octant & 1, octant >> 1 & 1, octant >> 2);
                if (glm::all(glm::lessThan(fine, volume.brick_count())))
                    reduce_brick<T>(volume.brick(fine), fine, volume.valid_in_brick(fine),
                                    reduction, samples);
            }
            builder.set_brick(position, Brick::make(std::span<const T>(samples), valid));
        });
    }
    return builder.finish();
}

} // namespace palpate
