#pragma once

#include <random>

#include "engine/volume/builder.h"

namespace palpate {

// Labels 0 .. kinds - 1; a sample repeats the one before it with probability `stay`, so that runs
// are long where it is near 1.
inline Volume random_labels(const Grid& grid, int kinds, double stay, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    std::uniform_int_distribution<int> label(0, kinds - 1);
    std::vector<uint8_t> samples(sample_count(grid));
    uint8_t last = 0;
    for (uint8_t& sample : samples) {
        if (share(random) >= stay)
            last = static_cast<uint8_t>(label(random));
        sample = last;
    }
    return make_volume<uint8_t>(grid, samples);
}

inline std::vector<float> samples_of(const Volume& volume) {
    std::vector<float> out(sample_count(volume.grid()));
    const glm::uvec3 size = volume.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            read_row(volume, {0, y, z}, size.x, out.data() + (size_t{z} * size.y + y) * size.x);
    return out;
}

inline glm::uvec3 index_of(glm::uvec3 size, size_t i) {
    return {i % size.x, i / size.x % size.y, i / (size_t{size.x} * size.y)};
}

} // namespace palpate
