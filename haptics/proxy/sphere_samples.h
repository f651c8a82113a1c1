#pragma once

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <span>

namespace palpate::haptics {

// Directions spread evenly over the sphere: a Fibonacci spiral. Filled for a number of samples, and
// again only when that number changes.
class SphereSamples {
 public:
    static constexpr uint32_t kMost = 4096;

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

 private:
    uint32_t count_ = 0;
    std::array<glm::dvec3, kMost> directions_;
};

} // namespace palpate::haptics
