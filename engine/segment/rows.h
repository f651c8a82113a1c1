#pragma once

#include <span>
#include <vector>

#include "engine/segment/task.h"
#include "engine/volume/builder.h"

namespace palpate {

// A volume of T made row by row: fill(y, z, row) writes the samples (0 .. size.x - 1, y, z), which
// hold 0 before, and is called from all threads.
template <class T, class Fill>
Result<Volume> make_rows(const Grid& grid, const Task& task, const Fill& fill) {
    VolumeBuilder builder(grid, scalar_type_of<T>);
    const glm::uvec3 bricks = builder.brick_count(), size = grid.size;
    const bool all = run_all(size_t{bricks.y} * bricks.z, task, [&](size_t i) {
        const glm::uvec3 first(0, i % bricks.y, i / bricks.y);
        const glm::uvec3 begin = first * kBrickSide;
        const glm::uvec3 end = glm::min(begin + kBrickSide, size);
        std::vector<T> samples(size_t{bricks.x} * kBrickSamples), row;
        for (uint32_t z = begin.z; z < end.z; ++z)
            for (uint32_t y = begin.y; y < end.y; ++y) {
                row.assign(size_t{bricks.x} * kBrickSide, T{});
                fill(y, z, std::span<T>(row.data(), size.x));
                const size_t to = offset_in_brick({0, y - begin.y, z - begin.z});
                for (size_t bx = 0; bx < bricks.x; ++bx)
                    std::copy_n(row.data() + bx * kBrickSide, kBrickSide,
                                samples.data() + bx * kBrickSamples + to);
            }
        for (uint32_t bx = 0; bx < bricks.x; ++bx)
            builder.set_brick(
                {bx, first.y, first.z},
                Brick::make(
                    std::span<const T>(samples.data() + size_t{bx} * kBrickSamples, kBrickSamples),
                    glm::min(glm::uvec3(kBrickSide),
                             size - glm::uvec3(bx, first.y, first.z) * kBrickSide)));
    });
    if (!all)
        return stopped();
    return builder.finish();
}

} // namespace palpate
