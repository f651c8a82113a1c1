#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace palpate::haptics {

// The place where the hand on a simulated device means to be, in the device's space. For the
// servo's thread and under its rules: no member allocates, throws or locks.
class HandSource {
 public:
    struct Meant {
        glm::dvec3 position_m{0.0}, velocity_m_per_s{0.0};
    };
    struct Held {
        glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // device_from_tool
        uint32_t buttons = 0;
    };
    virtual ~HandSource() = default;
    // Times are seconds since the device's start and never fall.
    virtual Meant meant(double time_s) noexcept = 0;
    virtual Held held(double time_s) noexcept = 0;
};

} // namespace palpate::haptics
