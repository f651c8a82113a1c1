#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

// A volume of T, each sample a function of the samples of volumes of one size at its place: calls
// map(std::array<float, N>) with NaN for no data, on all threads. Bricks that are constant in all
// of them are mapped once.
template <class T, size_t N, class Map>
Result<Volume> map_values(const std::array<const Volume*, N>& volumes, const Task& task,
                          const Map& map) {
    const Volume& first = *volumes[0];
    return make_bricks(first.grid(), scalar_type_of<T>, task, [&](glm::uvec3 position) {
        std::array<const Brick*, N> bricks;
        std::array<Brick::Pinned, N> pinned;
        bool is_constant = true;
        for (size_t n = 0; n < N; ++n) {
            bricks[n] = &volumes[n]->brick(position);
            pinned[n] = bricks[n]->pin();
            is_constant &= bricks[n]->is_constant();
        }
        thread_local std::vector<T> samples(kBrickSamples);
        const uint32_t count = is_constant ? 1 : kBrickSamples;
        for (uint32_t at = 0; at < count; ++at) {
            std::array<float, N> values;
            for (size_t n = 0; n < N; ++n)
                values[n] = bricks[n]->value(pinned[n], at);
            samples[at] = map(values);
        }
        return Brick::make(std::span<const T>(samples.data(), count),
                           first.valid_in_brick(position));
    });
}

} // namespace palpate
