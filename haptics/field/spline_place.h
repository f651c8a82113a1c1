#pragma once

#include <glm/glm.hpp>
#include <utility>

#include "engine/volume/cubic_weights.h"
#include "haptics/field/four.h"

namespace palpate::haptics {

inline int floor_of(double x) { // std::floor is a call on the oldest x86-64
    const int i = static_cast<int>(x);
    return i - (static_cast<double>(i) > x);
}

// The place of a point among blocks of 4x4x4 cells, and the cubic B-spline there from the 7x7x7
// coefficients of its block, those of samples 4 block - 1 and on.
struct SplinePlace {
    static constexpr int kSide = 7;
    glm::ivec3 block{}, cell{}; // the cell within the block
    CubicWeights<float> x, y, z;

    explicit SplinePlace(glm::dvec3 index) {
        const glm::ivec3 low(floor_of(index.x), floor_of(index.y), floor_of(index.z));
        block = low >> 2;
        cell = low & 3;
        x = cubic_weights(static_cast<float>(index.x - low.x));
        y = cubic_weights(static_cast<float>(index.y - low.y));
        z = cubic_weights(static_cast<float>(index.z - low.z));
    }
    const float* first(const float* numbers) const {
        return numbers + cell.x + kSide * (cell.y + kSide * cell.z);
    }
    float value(const float* numbers) const {
        const float* at = first(numbers);
        Four total{};
        for (int k = 0; k < 4; ++k) {
            Four plane{};
            for (int j = 0; j < 4; ++j)
                plane += y.value[size_t(j)] * load(at + kSide * (j + kSide * k));
            total += z.value[size_t(k)] * plane;
        }
        return sum(total * load(x.value.data()));
    }
    // Slope a sample.
    std::pair<float, glm::vec3> value_and_slope(const float* numbers) const {
        const float* at = first(numbers);
        Four total{}, dy{}, dz{};
        for (int k = 0; k < 4; ++k) {
            Four plane{}, plane_dy{};
            for (int j = 0; j < 4; ++j) {
                const Four row = load(at + kSide * (j + kSide * k));
                plane += y.value[size_t(j)] * row;
                plane_dy += y.slope[size_t(j)] * row;
            }
            total += z.value[size_t(k)] * plane;
            dy += z.value[size_t(k)] * plane_dy;
            dz += z.slope[size_t(k)] * plane;
        }
        const Four wx = load(x.value.data());
        return {sum(total * wx), {sum(total * load(x.slope.data())), sum(dy * wx), sum(dz * wx)}};
    }
};

} // namespace palpate::haptics
