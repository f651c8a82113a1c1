#pragma once

#include <memory>

#include "haptics/core/device.h"
#include "haptics/device/spacemouse/codec.h"
#include "haptics/device/transport/transport.h"

namespace palpate::haptics {

DeviceCapabilities spacemouse_capabilities();

// A 3Dconnexion device as a hand without force: its cap is pushed, and position and rotation move
// at a speed in proportion, within the workspace. Where nothing comes for kRest_ns although the cap
// was deflected, it counts as at rest. Its light is on while it is open.
class SpaceMouseDevice final : public HapticDevice {
 public:
    static constexpr double kSpeed_m_per_s = 0.1, kTurn_rad_per_s = 1.5; // at full deflection
    static constexpr int64_t kRest_ns = 50'000'000;

    // `description` of the device's report descriptor.
    SpaceMouseDevice(std::unique_ptr<Transport> transport,
                     const spacemouse::Description& description);
    ~SpaceMouseDevice() override;

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    Result<void> calibrate() override; // back to the middle, without rotation
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override;
    void halt(int64_t) noexcept override {}

    const spacemouse::State& state() const noexcept { return state_; }

 private:
    void light(bool on) noexcept;

    DeviceCapabilities capabilities_;
    std::unique_ptr<Transport> transport_;
    int range_;
    spacemouse::State state_;
    int64_t told_ns_ = 0; // deflections
    int64_t moved_ns_ = 0;
    glm::dvec3 position_m_{0.0};
    glm::dquat rotation_{1.0, 0.0, 0.0, 0.0};
};

} // namespace palpate::haptics
