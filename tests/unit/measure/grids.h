#pragma once

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/volume/builder.h"

namespace palpate {

// Uneven, turned, flipped, sheared.
inline Grid random_grid(std::mt19937& random) {
    std::uniform_real_distribution<double> real(-1.0, 1.0);
    glm::dmat4 m = glm::rotate(glm::dmat4(1.0), 3.0 * real(random),
                               glm::dvec3(real(random), real(random), 1.1 + real(random)));
    m = glm::scale(
        m, glm::dvec3(0.7 + 0.3 * real(random), random() % 2 ? 1.1 : -0.9, 2.0 + real(random)));
    glm::dmat4 shear(1.0);
    shear[2][0] = 0.2 * real(random);
    m = m * shear;
    m[3] = glm::dvec4(50.0 * real(random), 50.0 * real(random), 50.0 * real(random), 1.0);
    return {glm::uvec3(20 + random() % 30, 20 + random() % 30, 5 + random() % 20), m};
}

// Values that differ from sample to sample.
inline Volume noise_volume(const Grid& grid, ScalarType type = ScalarType::i16) {
    return make_volume(grid, type, [](glm::uvec3 i) {
        const uint32_t h = (i.x * 73856093u) ^ (i.y * 19349663u) ^ (i.z * 83492791u);
        return static_cast<double>(h % 4001) - 1000.0;
    });
}

template <class Visit>
void for_each_sample(const Grid& grid, Visit&& visit) {
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x)
                visit(glm::uvec3(x, y, z));
}

} // namespace palpate
