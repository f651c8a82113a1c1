#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "haptics/core/device.h"

namespace palpate::haptics {

// A hand that is moved by deflecting something: position and rotation move at a speed in proportion
// and stay where they are when it is let go.
class RateHand {
 public:
    static constexpr double kSpeed_m_per_s = 0.1, kTurn_rad_per_s = 1.5; // at full deflection

    explicit RateHand(glm::dvec3 workspace_m) : workspace_m_(workspace_m) {}
    void reset() noexcept; // to the middle, without rotation
    // Moves until now_ns by deflections of -1 .. 1 in the device's axes, and puts place, rotation
    // and velocity into `sample`. Times do not fall; a stall of more than 10 ms is no motion.
    void move(int64_t now_ns, glm::dvec3 push, glm::dvec3 turn, DeviceSample& sample) noexcept;

 private:
    glm::dvec3 workspace_m_;
    int64_t moved_ns_ = 0;
    glm::dvec3 position_m_{0.0};
    glm::dquat rotation_{1.0, 0.0, 0.0, 0.0};
};

} // namespace palpate::haptics
