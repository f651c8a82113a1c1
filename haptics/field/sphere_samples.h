#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <span>

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// Directions spread evenly over the sphere: a Fibonacci spiral. Filled for a number of samples, and
// again only when that number changes.
class SphereSamples {
 public:
    static constexpr uint32_t kMost = MostTouch::samples;

    std::span<const glm::dvec3> directions(uint32_t count) {
        count = std::clamp(count, 1u, kMost);
        if (count != count_) {
            count_ = count;
            const double turn = std::numbers::pi * (3.0 - std::sqrt(5.0));
            for (uint32_t i = 0; i < count; ++i) {
                const double z = 1.0 - (2.0 * i + 1.0) / count;
                const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
                directions_[i] = {r * std::cos(turn * i), r * std::sin(turn * i), z};
            }
        }
        return {directions_.data(), count_};
    }

    // The number of the direction nearest to one, of unit length. No place is farther from all
    // directions than 0.77 of sqrt(4 pi / count) (a chord; measured for 1 to 4096), so only those
    // of about its height are looked at.
    uint32_t nearest(glm::dvec3 way) const {
        const double middle = 0.5 * (1.0 - way.z) * count_;
        const double half = 0.5 * 0.78 * std::sqrt(4.0 * std::numbers::pi * count_) + 1.0;
        const auto first = static_cast<uint32_t>(std::clamp(middle - half, 0.0, count_ - 1.0));
        const auto last = static_cast<uint32_t>(std::clamp(middle + half, 0.0, count_ - 1.0));
        uint32_t found = first;
        double most = -2.0;
        for (uint32_t i = first; i <= last; ++i) {
            const double along = glm::dot(way, directions_[i]);
            found = along > most ? i : found;
            most = std::max(most, along);
        }
        return found;
    }

 private:
    uint32_t count_ = 0;
    std::array<glm::dvec3, kMost> directions_;
};

} // namespace palpate::haptics
