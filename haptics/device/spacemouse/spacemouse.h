#pragma once

#include <memory>

#include "haptics/core/device.h"
#include "haptics/device/rate_hand.h"
#include "haptics/device/spacemouse/codec.h"
#include "haptics/device/transport/transport.h"

namespace palpate::haptics {

DeviceCapabilities spacemouse_capabilities();

// A 3Dconnexion device as a hand without force that its cap moves (rate_hand.h). Where nothing
// comes for kRest_ns although the cap was deflected, it counts as at rest. Its light is on while it
// is open.
class SpaceMouseDevice final : public HapticDevice {
 public:
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
    RateHand hand_;
};

} // namespace palpate::haptics
