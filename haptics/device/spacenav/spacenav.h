#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "engine/base/fd.h"
#include "haptics/core/device.h"
#include "haptics/device/rate_hand.h"

// A 6-axis device by the daemon spacenavd, which owns it and shares it among programs.
namespace palpate::haptics {

namespace spacenav {

// An event of the daemon's first protocol: eight 32-bit numbers in the machine's order.
constexpr size_t kEvent = 32;
constexpr int kRange = 350; // deflection at full push, which the daemon passes on

struct State {
    std::array<int, 6> axes{}; // right, up, away from the person; turns about these
    uint32_t buttons = 0;

    friend bool operator==(const State&, const State&) = default;
};
// Puts an event into `state`, deflections clamped to +-kRange. False: an event of another kind, or
// a button beyond 32, and the state is as it was.
bool apply(std::span<const std::byte, kEvent> event, State& state) noexcept;

} // namespace spacenav

DeviceCapabilities spacenav_capabilities();

// The cap as a hand without force (rate_hand.h), by the daemon's socket. The daemon tells when the
// cap is at rest. Gone where the daemon ends.
class SpacenavDevice final : public HapticDevice {
 public:
    static constexpr const char* kSocket = "/var/run/spnav.sock";

    static Result<std::unique_ptr<SpacenavDevice>> open(const std::string& socket = kSocket);
    explicit SpacenavDevice(Fd socket);

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    Result<void> calibrate() override; // back to the middle, without rotation
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t, const Wrench&) noexcept override {
        return is_gone_ ? DeviceStatus::gone : DeviceStatus::ok;
    }
    void halt(int64_t) noexcept override {}

 private:
    DeviceCapabilities capabilities_;
    Fd socket_;
    std::array<std::byte, spacenav::kEvent> event_{};
    size_t came_ = 0; // bytes of event_
    spacenav::State state_;
    RateHand hand_;
    bool is_gone_ = false;
};

} // namespace palpate::haptics
