#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>

namespace palpate {

// Random numbers that are the same on every machine: the standard says what its engines give, and
// not what its distributions do.
class Draw {
 public:
    explicit Draw(uint64_t seed) : random_(seed) {}

    double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
    }
    glm::dvec3 within(double half_side) { // of a cube
        const double x = between(-half_side, half_side), y = between(-half_side, half_side);
        return {x, y, between(-half_side, half_side)};
    }
    // Nearly normal, mean 0 and variance 1: the sum of twelve, so never beyond +-6.
    double normal() {
        double sum = -6.0;
        for (int i = 0; i < 12; ++i)
            sum += between(0.0, 1.0);
        return sum;
    }
    size_t below(size_t count) { // 0 .. count - 1; count >= 1
        return std::min(size_t(between(0.0, 1.0) * static_cast<double>(count)), count - 1);
    }
    uint64_t bits() { return random_(); } // to seed another

 private:
    std::mt19937_64 random_;
};

} // namespace palpate
