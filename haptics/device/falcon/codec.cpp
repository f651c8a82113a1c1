#include "haptics/device/falcon/codec.h"

#include <algorithm>

namespace palpate::haptics::falcon {

namespace {

constexpr std::byte kBegin{'<'}, kEnd{'>'};
constexpr uint8_t kZero = 'A';

std::byte character(unsigned value) {
    return static_cast<std::byte>(kZero + value);
}

// The value of a payload character; other characters give one beyond any payload.
unsigned value_of(std::byte byte) {
    return std::to_integer<unsigned>(byte) - kZero;
}

void put_numbers(const std::array<int16_t, 3>& numbers, Packet& packet) {
    for (size_t n = 0; n < 3; ++n)
        for (size_t nibble = 0; nibble < 4; ++nibble)
            packet[1 + 4 * n + nibble] =
                character(static_cast<uint16_t>(numbers[n]) >> (4 * nibble) & 0xF);
}

Packet framed(const std::array<int16_t, 3>& numbers, unsigned bits) {
    Packet packet;
    packet.front() = kBegin;
    put_numbers(numbers, packet);
    packet[13] = character(bits);
    packet[14] = character(0);
    packet.back() = kEnd;
    return packet;
}

// False where a character is none of the protocol.
bool read(std::span<const std::byte, kPacket> packet, unsigned most_bits,
          std::array<int16_t, 3>& numbers, unsigned& bits) {
    if (packet.front() != kBegin || packet.back() != kEnd)
        return false;
    std::array<uint16_t, 3> raw{};
    for (size_t at = 0; at < 12; ++at) {
        const unsigned nibble = value_of(packet[1 + at]);
        if (nibble > 0xF)
            return false;
        raw[at / 4] = static_cast<uint16_t>(raw[at / 4] | nibble << (4 * (at % 4)));
    }
    bits = value_of(packet[13]);
    if (bits > most_bits)
        return false;
    for (size_t n = 0; n < 3; ++n)
        numbers[n] = static_cast<int16_t>(raw[n]);
    return true;
}

} // namespace

Packet encode(const Command& command) noexcept {
    return framed(command.motors, command.lights & 0xFu);
}

Packet encode(const State& state) noexcept {
    return framed(state.encoders, (state.buttons & 0xFu) | (state.homed & 0x7u) << 4);
}

bool decode(std::span<const std::byte, kPacket> packet, Command& command) noexcept {
    Command read_command;
    unsigned bits = 0;
    if (!read(packet, 0xF, read_command.motors, bits))
        return false;
    read_command.lights = static_cast<uint8_t>(bits);
    command = read_command;
    return true;
}

bool decode(std::span<const std::byte, kPacket> packet, State& state) noexcept {
    State read_state;
    unsigned bits = 0;
    if (!read(packet, 0x7F, read_state.encoders, bits))
        return false;
    read_state.buttons = static_cast<uint8_t>(bits & 0xF);
    read_state.homed = static_cast<uint8_t>(bits >> 4);
    state = read_state;
    return true;
}

bool Framer::add(std::byte byte, Packet& packet) noexcept {
    if (byte == kBegin) { // never a payload character
        lost_ += count_;
        count_ = 0;
    } else if (count_ == 0) {
        ++lost_;
        return false;
    }
    buffer_[count_++] = byte;
    if (count_ < kPacket)
        return false;
    if (byte != kEnd) {
        lost_ += count_;
        count_ = 0;
        return false;
    }
    count_ = 0;
    packet = buffer_;
    return true;
}

} // namespace palpate::haptics::falcon
