#pragma once

#include <algorithm>
#include <cmath>

#include "engine/volume/volume.h"

namespace palpate {

// The largest difference of samples that are neighbours along an axis.
inline double steepest(const Volume& volume) {
    double most = 0.0;
    const glm::uvec3 size = volume.size();
    for (uint32_t z = 1; z < size.z; ++z)
        for (uint32_t y = 1; y < size.y; ++y)
            for (uint32_t x = 1; x < size.x; ++x)
                for (const glm::uvec3 d : {glm::uvec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}})
                    most = std::max<double>(most, std::abs(volume.value({x, y, z}) -
                                                           volume.value(glm::uvec3(x, y, z) - d)));
    return most;
}

} // namespace palpate
