#pragma once

#include <gtest/gtest.h>

#include <random>

#include "haptics/device/falcon/codec.h"

namespace palpate::haptics::falcon {

// Streams of packets with bytes changed, dropped and added, and of chance. Each packet that is read
// is written back as it came, and its fields are in range. `inputs` counts packets.
inline void fuzz_codec(uint64_t seed, uint64_t inputs) {
    std::mt19937_64 random(seed);
    Framer framer;
    uint64_t read = 0;
    for (uint64_t i = 0; i < inputs; ++i) {
        Packet sent = encode(State{{static_cast<int16_t>(random()), static_cast<int16_t>(random()),
                                    static_cast<int16_t>(random())},
                                   static_cast<uint8_t>(random() & 0xF),
                                   static_cast<uint8_t>(random() & 0x7)});
        if (random() % 4 == 0)
            for (std::byte& byte : sent)
                byte = static_cast<std::byte>(random());
        for (const std::byte byte : sent) {
            const uint64_t chance = random();
            if (chance % 256 == 0)
                continue;
            Packet packet{};
            if (!framer.add(chance % 256 == 1 ? static_cast<std::byte>(chance >> 8) : byte, packet))
                continue;
            State state;
            if (!decode(packet, state))
                continue;
            ++read;
            ASSERT_LE(state.buttons, 0xF);
            ASSERT_LE(state.homed, State::kAllHomed);
            Packet again = encode(state);
            again[14] = packet[14]; // reserved
            ASSERT_EQ(again, packet);
        }
    }
    EXPECT_GT(read, inputs / 2);
}

} // namespace palpate::haptics::falcon
