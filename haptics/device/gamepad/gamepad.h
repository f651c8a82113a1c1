#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/fd.h"
#include "haptics/core/device.h"
#include "haptics/device/rate_hand.h"
#include "haptics/device/transport/plugged.h"

// Gamepads by the kernel's evdev.
namespace palpate::haptics {

namespace gamepad {

// The axes of a gamepad as the kernel's document on gamepads names them, in this order: left stick
// x and y, right stick x and y, cross x and y.
constexpr size_t kAxes = 6;
constexpr std::array<uint16_t, kAxes> kAxisCodes{0x00, 0x01, 0x03, 0x04, 0x10, 0x11};
constexpr uint16_t kFirstButton = 0x130; // BTN_SOUTH; 16 from it on

struct Range {
    int low = -1, high = 1; // low < high
    int flat = 0;           // about the middle, which counts as rest
};
using Ranges = std::array<Range, kAxes>;

struct State {
    std::array<double, kAxes> axes{}; // -1 .. 1; x to the right, y down
    uint32_t buttons = 0;             // bit 0: the lower one (A, cross)

    friend bool operator==(const State&, const State&) = default;
};
// Puts an event of evdev into `state`. False: of an axis or button that is not read, and the state
// is as it was.
bool apply(uint16_t type, uint16_t code, int32_t value, const Ranges& ranges,
           State& state) noexcept;
// A gamepad by its buttons, as sysfs tells them (device/capabilities/key).
bool is_gamepad(const std::string& key_capabilities);

} // namespace gamepad

DeviceCapabilities gamepad_capabilities();
std::vector<Plugged> plugged_gamepads();

// A gamepad as a hand without force (rate_hand.h): the left stick moves it to the right and up, the
// right stick away and towards the person and turns it about the vertical, the cross turns it about
// the other two axes.
class GamepadDevice final : public HapticDevice {
 public:
    static Result<std::unique_ptr<GamepadDevice>> open(const std::string& node);
    // Takes a descriptor that gives evdev's events without waiting.
    GamepadDevice(Fd events, const gamepad::Ranges& ranges);

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    Result<void> calibrate() override; // back to the middle, without rotation
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t, const Wrench&) noexcept override {
        return is_gone_ ? DeviceStatus::gone : DeviceStatus::ok;
    }
    void halt(int64_t) noexcept override {}

 private:
    DeviceCapabilities capabilities_;
    Fd events_;
    gamepad::Ranges ranges_;
    gamepad::State state_;
    RateHand hand_;
    bool is_gone_ = false;
};

} // namespace palpate::haptics
