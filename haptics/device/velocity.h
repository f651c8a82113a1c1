#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::haptics {

// Velocity from positions that come in encoder steps: first-order adaptive windowing.
//
// On each axis the longest window of past samples is taken whose straight line from its first to
// its last sample passes every sample between within the position's uncertainty. Slow motion gets a
// long window and little noise, a sudden stop a short one and little delay. At rest it gives 0.
// Source: F. Janabi-Sharifi, V. Hayward, C.-S. J. Chen, Discrete-time adaptive windowing for
// velocity estimation, IEEE Trans. Control Systems Technology 8(6), 2000.
class VelocityEstimator {
 public:
    static constexpr uint32_t kWindow = 16; // samples at most, the newest included

    // A position is known to +-uncertainty; an encoder of step d: d. 0 gives plain differences.
    explicit VelocityEstimator(double uncertainty = 0.0) : uncertainty_(uncertainty) {}

    void reset() noexcept { count_ = 0; }
    // The velocity now, in units of position a second; 0 at the first sample. dt_s > 0.
    glm::dvec3 add(glm::dvec3 position, double dt_s) noexcept;

 private:
    double along(int axis) const noexcept;
    glm::dvec3 position(uint32_t back) const noexcept { // 0: the newest
        return positions_[(next_ + 2 * kWindow - 1 - back) % kWindow];
    }

    double uncertainty_;
    std::array<glm::dvec3, kWindow> positions_{};
    std::array<double, kWindow> dts_{}; // from the sample before
    uint32_t next_ = 0, count_ = 0;
};

} // namespace palpate::haptics
