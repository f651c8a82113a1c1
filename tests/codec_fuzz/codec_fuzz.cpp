// Any bytes to the codecs of devices, chosen by coverage (libFuzzer). What decodes is in range, and
// is encoded as it came.

#include <cstdlib>
#include <vector>

#include "haptics/device/falcon/codec.h"
#include "haptics/device/spacemouse/codec.h"
#include "haptics/device/wooden/codec.h"

using namespace palpate::haptics;

namespace {

void expect(bool holds) {
    if (!holds)
        std::abort();
}

void falcon_stream(std::span<const std::byte> bytes) {
    falcon::Framer framer;
    falcon::Packet packet;
    for (const std::byte byte : bytes) {
        if (!framer.add(byte, packet))
            continue;
        falcon::State state;
        if (falcon::decode(packet, state)) {
            expect(state.buttons <= 0xF && state.homed <= falcon::State::kAllHomed);
            falcon::Packet again = falcon::encode(state);
            again[14] = packet[14]; // reserved
            expect(again == packet);
        }
        falcon::Command command;
        if (falcon::decode(packet, command))
            expect(command.lights <= 0xF);
    }
}

// The same bytes within the frame and the letters of the protocol, which chance does not hit: most
// packets are then whole, and a byte of 0xF0 and above goes in as it is.
void falcon_packets(std::span<const std::byte> bytes) {
    std::vector<std::byte> stream;
    for (; bytes.size() >= falcon::kPacket - 2; bytes = bytes.subspan(falcon::kPacket - 2)) {
        stream.push_back(std::byte{'<'});
        for (size_t at = 0; at < falcon::kPacket - 2; ++at) {
            const auto value = std::to_integer<unsigned>(bytes[at]);
            const unsigned most = at == 12 ? 0x7F : 0xF; // the bits of buttons and homing
            stream.push_back(value >= 0xF0 ? bytes[at]
                                           : static_cast<std::byte>('A' + (value & most)));
        }
        stream.push_back(std::byte{'>'});
    }
    falcon_stream(stream);
}

void reports(std::span<const std::byte> bytes) {
    spacemouse::State pushed;
    spacemouse::decode(bytes, 350, pushed);
    for (const int axis : pushed.axes)
        expect(std::abs(axis) <= 350);
    const int range = spacemouse::describe(bytes).range;
    expect(range > 0 && range <= 32767);
    wooden::State state;
    if (wooden::decode(bytes, state)) {
        const auto again = wooden::encode(state);
        for (size_t i = 0; i < again.size(); ++i)
            expect(again[i] == bytes[i]);
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto bytes = std::as_bytes(std::span(data, size));
    falcon_stream(bytes);
    falcon_packets(bytes);
    reports(bytes);
    return 0;
}
