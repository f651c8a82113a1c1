#pragma once

#include <vector>

#include "engine/volume/box.h"

namespace palpate::bench {

// All samples of a volume in one array, x fastest: the volumes of trials are small.
inline std::vector<float> samples_of(const Volume& volume) {
    std::vector<float> samples(sample_count(volume.grid()));
    read_box(volume, glm::ivec3(0), glm::ivec3(volume.size()), packed(volume.size()),
             samples.data());
    return samples;
}

inline glm::uvec3 index_of(glm::uvec3 size, size_t i) {
    return {i % size.x, i / size.x % size.y, i / (size_t{size.x} * size.y)};
}

} // namespace palpate::bench
