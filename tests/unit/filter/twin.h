#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "engine/volume/builder.h"
#include "engine/volume/grid.h"

// Plain twins of filters, in double precision and without bricks, and the volumes they are held
// against.
namespace palpate::twin {

inline std::vector<glm::ivec3> indices(glm::ivec3 size) {
    std::vector<glm::ivec3> all;
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x)
                all.emplace_back(x, y, z);
    return all;
}

// The nearest sample within the volume.
inline double at(const Volume& volume, glm::ivec3 i) {
    return volume.value(glm::uvec3(glm::clamp(i, glm::ivec3(0), glm::ivec3(volume.size()) - 1)));
}

// Random whole numbers -500 .. 1500; of f32 one in `missing` has no data (0: none).
inline Volume noise(const Grid& grid, ScalarType type, uint32_t missing = 0, uint32_t seed = 1) {
    return make_volume(grid, type, [=](glm::uvec3 i) {
        std::mt19937 random(seed + i.x + 1000 * i.y + 1000000 * i.z);
        random.discard(3);
        if (missing > 0 && random() % missing == 0)
            return std::nan("");
        return double(random() % 2001) - 500.0;
    });
}

// A grid turned about two axes, whose third is slanted by 0.3 towards the second where sheared.
inline Grid turned(glm::uvec3 size, glm::dvec3 spacing, bool sheared = false) {
    const double c = 0.8, s = 0.6;
    const glm::dmat3 about_z(c, s, 0, -s, c, 0, 0, 0, 1), about_x(1, 0, 0, 0, c, s, 0, -s, c);
    glm::dmat3 axes = about_z * about_x;
    if (sheared)
        axes[2] = glm::normalize(axes[2] + 0.3 * axes[1]);
    Grid grid{size, glm::dmat4(1)};
    for (int a = 0; a < 3; ++a)
        grid.world_from_index[a] = glm::dvec4(axes[a] * spacing[a], 0);
    grid.world_from_index[3] = glm::dvec4(-40, 25, 310, 1);
    return grid;
}

inline bool same_bits(const Volume& a, const Volume& b) {
    if (a.type() != b.type() || a.size() != b.size())
        return false;
    for (const glm::ivec3 i : indices(glm::ivec3(a.size()))) {
        const float u = a.value(glm::uvec3(i)), v = b.value(glm::uvec3(i));
        if (!(u == v || (std::isnan(u) && std::isnan(v))))
            return false;
    }
    return true;
}

} // namespace palpate::twin
