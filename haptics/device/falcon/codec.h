#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

// Packets of the Novint Falcon's run-time firmware, as public drivers describe them: 16 bytes each
// way, '<', 14 characters that are a nibble plus 'A', '>'. Numbers are four nibbles, the lowest
// first, of a signed 16-bit value. Pure functions.
namespace palpate::haptics::falcon {

constexpr size_t kPacket = 16;
using Packet = std::array<std::byte, kPacket>;

// Bits of the last payload character to the device. Drivers and their comments differ about which
// colour is which bit: the owner's checklist asks. Nothing else names them.
enum Light : uint8_t { kHoming = 0x1, kGreen = 0x2, kBlue = 0x4, kRed = 0x8 };

struct Command {
    std::array<int16_t, 3> motors{}; // counts of torque
    uint8_t lights = 0;              // Light bits; 0 .. 15

    friend bool operator==(const Command&, const Command&) = default;
};

struct State {
    std::array<int16_t, 3> encoders{}; // counts
    uint8_t buttons = 0;               // 1 plus, 2 forward, 4 centre, 8 minus
    uint8_t homed = 0;                 // a bit for each axis
    static constexpr uint8_t kAllHomed = 7;

    friend bool operator==(const State&, const State&) = default;
};

Packet encode(const Command& command) noexcept;
Packet encode(const State& state) noexcept; // as the firmware does, for models of it
// False: not a packet, and the value is as it was.
bool decode(std::span<const std::byte, kPacket> packet, Command& command) noexcept;
bool decode(std::span<const std::byte, kPacket> packet, State& state) noexcept;

// Finds packets in a stream of bytes. After bytes that belong to none it goes on at the next '<',
// also where that lies within what began as a packet.
class Framer {
 public:
    // True: `packet` holds a whole one, which may still have payload that decode() refuses.
    bool add(std::byte byte, Packet& packet) noexcept;
    void reset() noexcept { count_ = 0; }
    uint64_t lost_bytes() const noexcept { return lost_; } // that belonged to no packet

 private:
    Packet buffer_{};
    size_t count_ = 0;
    uint64_t lost_ = 0;
};

} // namespace palpate::haptics::falcon
