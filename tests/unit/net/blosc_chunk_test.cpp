#include "engine/net/blosc_chunk.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "tests/unit/net/wire.h"

namespace palpate {

namespace {

using testing::HasSubstr;
using wire::Bytes;

Bytes made(size_t count, const std::function<int(size_t)>& byte) {
    Bytes bytes;
    for (size_t i = 0; i < count; ++i)
        bytes.push_back(std::byte(uint8_t(byte(i))));
    return bytes;
}

// Samples 10 (i / 25) - 100 of two bytes.
int ramp_byte(size_t at) {
    const int value = int(at / 2 / 25) * 10 - 100;
    return (value >> (at % 2 * 8)) & 255;
}

Bytes read(const Bytes& chunk, size_t size) {
    Bytes out(size);
    const Result<void> result = read_blosc_chunk(chunk, out);
    EXPECT_TRUE(result) << result.error().message;
    return result ? out : Bytes();
}

std::string refusal(const Bytes& chunk, size_t size) {
    Bytes out(size);
    const Result<void> result = read_blosc_chunk(chunk, out);
    return result ? "" : result.error().message;
}

// Chunks that c-blosc2 3.3.2 made of data that a formula tells.
TEST(BloscChunk, ChunksOfTheLibraryAreRead) {
    // One stream.
    EXPECT_EQ(read(wire::from_hex("05019508e8030000e80300005d00000000000000000005000000000000000000"
                                  "240000003500000028b5"
                                  "2ffd60e8025d0100a00100010001000100010001000100010001000100146801"
                                  "f0c510feff3f19fb01db"
                                  "3ccff37a9ee7850419"),
                   1000),
              made(1000, [](size_t i) { return i % 100 < 37; }));
    // Two blocks of two streams each, shuffled; the last block is one stream.
    EXPECT_EQ(
        read(wire::from_hex("05018502e80300000002000096000000000000000001050000000000000000002800"
                            "00006b0000002300000028b52ffd600000cd0000809ca6b0bac4ced8e2ecf6000000"
                            "0000000a6401d0e315820c1800000028b52ffd60000075000038ff00000000000001"
                            "00762827042700000028b52ffd60e800ed000058000a141e28323c46505a000b6001"
                            "e0c501700a044110048160413c19"),
             1000),
        made(1000, ramp_byte));
    // One block of one stream, shuffled.
    EXPECT_EQ(
        read(wire::from_hex(
                 "05019502e8030000e8030000590000000000000000010500000000000000000024000000310000"
                 "0028b52ffd60e8023d0100b09ca6b0bac4ced8e2ecf6000a141e28323c46505aff00166801f0c5"
                 "10fedfafff77f6b42f3132"),
             1000),
        made(1000, ramp_byte));
    // A run of one byte.
    EXPECT_EQ(read(wire::from_hex("05019501e8030000e80300002900000000000000000005000000000000000000"
                                  "24000000f9ffffff01"),
                   1000),
              made(1000, [](size_t) { return 7; }));
    // A chunk that is zero throughout.
    EXPECT_EQ(
        read(wire::from_hex("05019501e8030000e80300002000000000000000000005000000000000000010"),
             1000),
        made(1000, [](size_t) { return 0; }));
    // A stream that zstd could not make shorter.
    EXPECT_EQ(
        read(wire::from_hex(
                 "050195013c0000003c0000006400000000000000000005000000000000000000240000003c00"
                 "0000000816305ca0078d42274299371d51d9c00cb9d76c79091dbbeebc2b3cf5668b6f1887c7"
                 "ded2a96918b756f1984c13eeed1665e5a19ad6603967f0df"),
             60),
        made(60, [](size_t i) { return int((i * i * i + i * 7) % 251); }));
}

TEST(BloscChunk, EveryFormIsReadBack) {
    std::mt19937 random(1);
    for (int trial = 0; trial < 200; ++trial) {
        const size_t sample_bytes = 1 + random() % 8;
        const size_t size = sample_bytes * (1 + random() % 400) + random() % 3;
        const size_t block = std::min(size, sample_bytes * (1 + random() % 100));
        const Bytes data = wire::some_bytes(random, size);
        const wire::ChunkForm form{sample_bytes, block, random() % 2 == 0,
                                   random() % 2 == 0 && block % sample_bytes == 0};
        EXPECT_EQ(read(wire::chunk_of(data, form), size), data) << "trial " << trial;
    }
}

TEST(BloscChunk, WhatIsWrittenIsReadBack) {
    std::mt19937 random(2);
    for (const size_t size : {0, 1, 7, 4096, (1 << 20) - 1, 1 << 20, (3 << 20) + 5})
        for (const size_t sample_bytes : {1, 2, 4}) {
            const Bytes data = wire::some_bytes(random, size);
            const Bytes chunk = write_blosc_chunk(data, sample_bytes);
            EXPECT_EQ(read(chunk, size), data) << size << " bytes of " << sample_bytes;
        }
}

TEST(BloscChunk, ChunksOfOneValueAreFilled) {
    // Eight bytes, the value 34 12 behind the header.
    const Bytes chunk =
        wire::from_hex("05019502080000000800000022000000000000000000050000000000000000303412");
    EXPECT_EQ(read(chunk, 8), wire::from_hex("3412341234123412"));
    Bytes not_a_number = chunk;
    not_a_number[31] = std::byte{0x20};
    EXPECT_THAT(refusal(not_a_number, 8), HasSubstr("not a number"));
}

TEST(BloscChunk, WrongLengthsAreNamed) {
    const Bytes data = made(500, [](size_t i) { return int(i % 7); });
    const Bytes chunk = wire::chunk_of(data, {1, 500, false, false});
    EXPECT_EQ(refusal(chunk, 499), "expected a blosc2 chunk that holds 499 bytes, found 500");
    for (size_t length = 0; length < chunk.size(); ++length)
        EXPECT_NE(refusal(Bytes(chunk.begin(), chunk.begin() + ptrdiff_t(length)), 500), "");
    Bytes lz4 = chunk;
    lz4[2] = std::byte(0x15 | 1 << 5);
    EXPECT_THAT(refusal(lz4, 500), HasSubstr("found codec 1"));
    Bytes filtered = chunk;
    filtered[21] = std::byte{2};
    EXPECT_THAT(refusal(filtered, 500), HasSubstr("found filter 2"));
    Bytes with_dictionary = chunk;
    with_dictionary[31] = std::byte{1};
    EXPECT_THAT(refusal(with_dictionary, 500), HasSubstr("without a dictionary"));
}

} // namespace

} // namespace palpate
