#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

// Reports of 3Dconnexion's 6-axis devices. Two layouts exist, also of one product id, so reports
// are told apart by their id and length. Pure functions.
namespace palpate::haptics::spacemouse {

struct State {
    std::array<int16_t, 6> axes{}; // X, Y, Z, Rx, Ry, Rz: deflections, -range .. range
    uint32_t buttons = 0;          // bit b: button b
    int battery_percent = -1;      // -1: not told
    bool is_charging = false;

    friend bool operator==(const State&, const State&) = default;
};

enum class Told : uint8_t { nothing, axes, buttons, battery };

// Puts what a report tells into `state`, deflections clamped to +-range. nothing: a report that is
// too short or of another kind, and the state is as it was.
//
//   1: X Y Z, or X Y Z Rx Ry Rz where it is long enough; 2: Rx Ry Rz; 16 bits each, little-endian
//   3: up to 32 buttons; 0x17: battery in percent, and whether it is charged
Told decode(std::span<const std::byte> report, int range, State& state) noexcept;

constexpr std::array<std::byte, 2> led_report(bool on) noexcept {
    return {std::byte{4}, on ? std::byte{1} : std::byte{0}};
}

// The contents of a HID report descriptor (USB HID 1.11, 6.2.2).
struct Description {
    bool is_six_axis = false; // a multi-axis controller (generic desktop, usage 8)
    int range = 350;          // largest deflection that it names; 350 where it names none
};
// Whatever the bytes: a description; of bytes that are no descriptor, the default one.
Description describe(std::span<const std::byte> descriptor) noexcept;

} // namespace palpate::haptics::spacemouse
