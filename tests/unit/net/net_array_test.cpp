#include "engine/net/net_array.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "engine/net/blosc_chunk.h"
#include "engine/volume/builder.h"
#include "tests/unit/net/wire.h"

namespace palpate {

namespace {

using testing::HasSubstr;
using wire::Bytes;

std::vector<uint8_t> numbers(const Bytes& bytes) {
    std::vector<uint8_t> out;
    for (const std::byte b : bytes)
        out.push_back(std::to_integer<uint8_t>(b));
    return out;
}

std::string refusal(const Bytes& array, const std::vector<int64_t>& shape) {
    const auto result = read_net_array(array, shape);
    return result ? "" : result.error().message;
}

TEST(NetArray, ArraysInChunksAreRead) {
    std::mt19937 random(3);
    for (int trial = 0; trial < 100; ++trial) {
        const std::vector<int64_t> shape{1 + int64_t(random() % 6), 1 + int64_t(random() % 20),
                                         1 + int64_t(random() % 20)};
        const Bytes data = wire::some_bytes(random, size_t(shape[0] * shape[1] * shape[2]));
        const char* types[] = {"uint8", "int8", "bool"};
        const Bytes array = wire::array_of(data, shape, types[random() % 3], 1 + random() % 900,
                                           {1, 1 + random() % 300, random() % 2 == 0, false});
        const auto read = read_net_array(array, shape);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(*read, numbers(data));
    }
}

TEST(NetArray, WhatIsWrittenIsReadBack) {
    std::mt19937 random(4);
    const std::vector<uint8_t> bytes = numbers(wire::some_bytes(random, 12 * 10 * 9));
    const std::vector<int64_t> shape{9, 10, 12};
    const auto read = read_net_array(write_net_array(bytes, shape), shape);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, bytes);
}

// The header and the samples of an image, read by the test itself.
TEST(NetArray, ImagesHaveTheAxesZYX) {
    const Grid grid = make_grid({5, 4, 3}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::i16, [](glm::uvec3 at) {
        return double(at.x) + 10.0 * at.y + 100.0 * at.z - 150.0;
    });
    const Bytes array = write_net_image(volume);
    Bytes expected;
    for (const char c : std::string_view("NNIA\x01\x01\x04\x05int16"))
        expected.push_back(std::byte(uint8_t(c)));
    for (const int size : {1, 3, 4, 5})
        wire::put(expected, uint64_t(size), 8);
    wire::put(expected, 1, 4);
    wire::put(expected, 120, 8);
    ASSERT_GT(array.size(), expected.size() + 8);
    EXPECT_EQ(Bytes(array.begin(), array.begin() + ptrdiff_t(expected.size())), expected);
    Bytes samples(120);
    const auto chunk = std::span(array).subspan(expected.size() + 8);
    ASSERT_TRUE(read_blosc_chunk(chunk, samples));
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 5; ++x) {
                int16_t value;
                std::memcpy(&value, samples.data() + 2 * (x + 5 * (y + 4 * z)), 2);
                EXPECT_EQ(value, x + 10 * y + 100 * z - 150);
            }
}

TEST(NetArray, SamplesWithoutDataHoldTheLeastValue) {
    const std::vector<float> values{3.0f, std::numeric_limits<float>::quiet_NaN(), -2.0f, 8.0f};
    const Bytes array =
        write_net_image(make_volume<float>(make_grid({4, 1, 1}, {1, 1, 1}), values));
    Bytes samples(16);
    // Magic, bytes, "float32", four sizes, the number of chunks and two lengths come before.
    ASSERT_TRUE(read_blosc_chunk(std::span(array).subspan(8 + 7 + 32 + 4 + 16), samples));
    float sent[4];
    std::memcpy(sent, samples.data(), sizeof sent);
    EXPECT_THAT(sent, testing::ElementsAre(3.0f, -2.0f, -2.0f, 8.0f));
}

TEST(NetArray, OtherShapesAndTypesAreNamed) {
    const Bytes data(24);
    const Bytes array = wire::array_of(data, {2, 3, 4}, "uint8", 24, {});
    EXPECT_EQ(refusal(array, {2, 3, 4}), "");
    EXPECT_EQ(refusal(array, {4, 3, 2}), "expected an array of 4 x 3 x 2, found 2 x 3 x 4");
    EXPECT_EQ(refusal(array, {2, 3}), "expected an array of 2 x 3, found 2 x 3 x 4");
    EXPECT_EQ(refusal(wire::array_of(data, {2, 3, 4}, "float32", 24, {}), {2, 3, 4}),
              "expected an array of uint8, int8 or bool, found float32");
    // An array that states a huge shape takes no memory for it.
    const Bytes huge = wire::array_of(data, {1 << 20, 1 << 20, 1 << 20}, "uint8", 24, {});
    EXPECT_THAT(refusal(huge, {2, 3, 4}), HasSubstr("found 1048576 x 1048576 x 1048576"));
    Bytes longer = array;
    longer.push_back({});
    EXPECT_EQ(refusal(longer, {2, 3, 4}), "expected the end of an array, found 1 more bytes");
    for (size_t length = 0; length < array.size(); ++length)
        EXPECT_NE(refusal(Bytes(array.begin(), array.begin() + ptrdiff_t(length)), {2, 3, 4}), "");
}

} // namespace

} // namespace palpate
