#include "haptics/device/falcon/codec.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/unit/haptics_falcon/codec_fuzz.h"

namespace palpate::haptics::falcon {
namespace {

std::string text(const Packet& packet) {
    return {reinterpret_cast<const char*>(packet.data()), packet.size()};
}

TEST(FalconCodec, PacketsAreThoseOfTheProtocol) {
    EXPECT_EQ(text(encode(Command{})), "<AAAAAAAAAAAAAA>");
    // 0x1234 is 4, 3, 2, 1 after 'A'; -1 is F four times; -4096 is 0xF000.
    EXPECT_EQ(text(encode(Command{{0x1234, -1, -4096}, kRed | kHoming})), "<EDCBPPPPAAAPJA>");
    EXPECT_EQ(text(encode(State{{-32768, 32767, 0}, 0x9, 0x7})),
              "<AAAIPPPHAAAA\xBA"
              "A>");
}

TEST(FalconCodec, EveryNumberComesBackOnEveryAxis) {
    for (int value = -32768; value <= 32767; ++value)
        for (size_t axis = 0; axis < 3; ++axis) {
            Command command{.lights = static_cast<uint8_t>(value & 0xF)}, command_back;
            command.motors[axis] = static_cast<int16_t>(value);
            ASSERT_TRUE(decode(encode(command), command_back));
            ASSERT_EQ(command_back, command);
            State state{.buttons = static_cast<uint8_t>(value & 0xF),
                        .homed = static_cast<uint8_t>(value >> 4 & 7)},
                state_back;
            state.encoders[axis] = static_cast<int16_t>(value);
            ASSERT_TRUE(decode(encode(state), state_back));
            ASSERT_EQ(state_back, state);
        }
}

TEST(FalconCodec, OnlyPacketsAreRead) {
    const Packet good = encode(State{{1, 2, 3}, 1, 7});
    for (size_t at = 0; at < kPacket; ++at)
        for (int value = 0; value < 256; ++value) {
            Packet packet = good;
            packet[at] = static_cast<std::byte>(value);
            State state{{9, 9, 9}, 9, 0};
            const bool is_frame = at == 0 ? value == '<' : at == 15 ? value == '>' : true;
            const bool is_payload = at == 0 || at >= 14 ||
                                    (value >= 'A' && value <= (at == 13 ? 'A' + 0x7F : 'A' + 0xF));
            ASSERT_EQ(decode(packet, state), is_frame && is_payload) << at << ' ' << value;
            if (!(is_frame && is_payload)) {
                ASSERT_EQ(state, (State{{9, 9, 9}, 9, 0})); // untouched
            }
        }
}

TEST(FalconCodec, AStreamIsFollowedThroughDamage) {
    const Packet first = encode(State{{1, 2, 3}, 0, 7}), second = encode(State{{4, 5, 6}, 0, 7});
    // A packet cut short at every place, then a whole one: the whole one is found.
    for (size_t cut = 0; cut < kPacket; ++cut) {
        Framer framer;
        Packet packet{};
        int found = 0;
        for (size_t i = 0; i < cut; ++i)
            found += framer.add(first[i], packet);
        for (const std::byte byte : second)
            found += framer.add(byte, packet);
        EXPECT_EQ(found, 1);
        EXPECT_EQ(packet, second);
        EXPECT_EQ(framer.lost_bytes(), cut);
    }
    // A byte inserted or flipped at every place costs that packet and no other.
    for (size_t at = 0; at < kPacket; ++at)
        for (const bool inserted : {false, true}) {
            std::vector<std::byte> stream(first.begin(), first.end());
            if (inserted)
                stream.insert(stream.begin() + static_cast<long>(at), std::byte{'x'});
            else
                stream[at] = std::byte{'x'};
            stream.insert(stream.end(), second.begin(), second.end());
            Framer framer;
            Packet packet{};
            for (const std::byte byte : stream)
                framer.add(byte, packet);
            EXPECT_EQ(packet, second) << at;
        }
}

TEST(FalconCodec, NoStreamOfBytesGivesAValueOutOfRange) {
    fuzz_codec(17, 300'000);
}

} // namespace
} // namespace palpate::haptics::falcon
