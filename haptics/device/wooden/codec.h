#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

// Reports of WoodenHaptics and Polhem, as their open firmware describes them: 14 bytes each way,
// seven signed 16-bit numbers, little-endian. Pure functions.
namespace palpate::haptics::wooden {

constexpr size_t kReport = 14;

// To the device. On the HID the number of the report, 0, goes before it.
struct Command {
    std::array<int16_t, 3> motors_ma{};
    int16_t order = 0; // 1: `encoders` are what the encoders count now
    std::array<int16_t, 3> encoders{};

    friend bool operator==(const Command&, const Command&) = default;
};
constexpr int16_t kSetEncoders = 1;

struct State {
    std::array<int16_t, 6> encoders{}; // counts; the last three of the gimbal
    int16_t info = 0;

    friend bool operator==(const State&, const State&) = default;
};

std::array<std::byte, kReport> encode(const Command& command) noexcept;
std::array<std::byte, kReport> encode(const State& state) noexcept; // for models of the firmware
// Of a report of at least 14 bytes; boards fill it up to 64. False: shorter, the value is as it
// was.
bool decode(std::span<const std::byte> report, Command& command) noexcept;
bool decode(std::span<const std::byte> report, State& state) noexcept;

} // namespace palpate::haptics::wooden
