#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "haptics/device/transport/transport.h"

// The FTDI chip between the USB and the Falcon's serial line: its vendor requests, and the two
// status bytes that it puts before every packet.
namespace palpate::haptics::falcon {

constexpr uint8_t kOutEndpoint = 0x02, kInEndpoint = 0x81;
constexpr size_t kUsbPacket = 64;           // bytes of a full-speed bulk packet
constexpr size_t kPayload = kUsbPacket - 2; // of them on the serial line, towards the computer
enum Slot : size_t { kOutSlot, kInSlot, kControlSlot }; // transfers of the transport

enum class BridgeRequest : uint8_t {
    reset = 0,   // 0: all, 1: drop what came, 2: drop what is to go
    modem = 1,   // kDtrLow ...
    flow = 2,    // 0: none
    divisor = 3, // of 3 MHz
    format = 4,  // 8: 8 bits, no parity, 1 stop bit
    event = 6,   // a character, and 0x100: the chip sends what it has as soon as that has come
    latency = 9, // ms after which it sends what it has
};
constexpr uint16_t kDtrLow = 0x0100, kDtrHigh = 0x0101, kRtsLow = 0x0200;
constexpr uint16_t kBaud9600 = 0x4138, kBaudLoad = 21, kBaudRun = 2; // 140 k, 1.5 M

constexpr UsbSetup bridge_setup(BridgeRequest request, uint16_t value) noexcept {
    return {.type = 0x40, .request = static_cast<uint8_t>(request), .value = value, .index = 0};
}

// The bytes of the serial line in one USB packet; empty where it holds status alone or less.
inline std::span<const std::byte> payload_of(std::span<const std::byte> usb_packet) noexcept {
    return usb_packet.size() > 2 ? usb_packet.subspan(2) : std::span<const std::byte>();
}

} // namespace palpate::haptics::falcon
