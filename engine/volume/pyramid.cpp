#include "engine/volume/pyramid.h"

#include <limits>

#include "engine/base/assert.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

namespace {

constexpr uint32_t kOctantSide = kBrickSide / 2;

// The mean of the samples [low, high) of a brick.
template <class T>
T mean(const T* samples, glm::uvec3 low, glm::uvec3 high) {
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t z = low.z; z < high.z; ++z)
        for (uint32_t y = low.y; y < high.y; ++y)
            for (uint32_t x = low.x; x < high.x; ++x) {
                const T value = samples[offset_in_brick({x, y, z})];
                if (value == value) {
                    sum += static_cast<double>(value);
                    ++count;
                }
            }
    if constexpr (std::is_floating_point_v<T>)
        return count > 0 ? static_cast<T>(sum / count) : std::numeric_limits<T>::quiet_NaN();
    else
        return nearest_stored<T>(sum / count);
}

} // namespace

Grid coarser_grid(const Grid& grid) {
    Grid coarse;
    glm::dmat4 fine_from_coarse(1);
    for (int axis = 0; axis < 3; ++axis) {
        coarse.size[axis] = (grid.size[axis] + 1) / 2;
        if (grid.size[axis] > 1) {
            fine_from_coarse[axis][axis] = 2.0;
            fine_from_coarse[3][axis] = 0.5;
        }
    }
    coarse.world_from_index = grid.world_from_index * fine_from_coarse;
    return coarse;
}

uint32_t level_count(glm::uvec3 size) {
    uint32_t levels = 1;
    for (uint32_t longest = std::max({size.x, size.y, size.z}); longest > kBrickSide; ++levels)
        longest = (longest + 1) / 2;
    return levels;
}

template <class T>
void reduce_brick(const Brick& fine, glm::uvec3 position, glm::uvec3 valid, Reduction reduction,
                  std::span<T> coarse) {
    PALPATE_ASSERT_CMP(coarse.size(), ==, size_t{kBrickSamples});
    const BrickSamples<T> held = fine.samples<T>();
    const T* samples = held.data();
    const glm::uvec3 start = position % 2u * kOctantSide;
    const glm::uvec3 count = (valid + 1u) / 2u;
    for (uint32_t z = 0; z < count.z; ++z)
        for (uint32_t y = 0; y < count.y; ++y)
            for (uint32_t x = 0; x < count.x; ++x) {
                const glm::uvec3 low = 2u * glm::uvec3(x, y, z);
                T& out = coarse[offset_in_brick(start + glm::uvec3(x, y, z))];
                if (fine.is_constant())
                    out = samples[0];
                else if (reduction == Reduction::first)
                    out = samples[offset_in_brick(low)];
                else
                    out = mean(samples, low, glm::min(low + 2u, valid));
            }
}

template void reduce_brick(const Brick&, glm::uvec3, glm::uvec3, Reduction, std::span<uint8_t>);
template void reduce_brick(const Brick&, glm::uvec3, glm::uvec3, Reduction, std::span<int8_t>);
template void reduce_brick(const Brick&, glm::uvec3, glm::uvec3, Reduction, std::span<uint16_t>);
template void reduce_brick(const Brick&, glm::uvec3, glm::uvec3, Reduction, std::span<int16_t>);
template void reduce_brick(const Brick&, glm::uvec3, glm::uvec3, Reduction, std::span<float>);

} // namespace palpate
