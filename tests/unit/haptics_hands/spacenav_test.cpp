#include "haptics/device/spacenav/spacenav.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <random>

namespace palpate::haptics {
namespace {

using namespace spacenav;

constexpr int64_t kMs = 1'000'000;
using Event = std::array<std::byte, kEvent>;

Event event(std::array<int32_t, 8> numbers) {
    Event bytes;
    std::memcpy(bytes.data(), numbers.data(), kEvent);
    return bytes;
}

TEST(SpacenavCodec, MotionAndButtons) {
    State state;
    EXPECT_TRUE(spacenav::apply(event({0, 100, -200, 9999, -9999, 0, 350, 16}), state));
    EXPECT_EQ(state.axes, (std::array{100, -200, 350, -350, 0, 350}));
    EXPECT_TRUE(spacenav::apply(event({1, 31}), state));
    EXPECT_TRUE(spacenav::apply(event({1, 0}), state));
    EXPECT_EQ(state.buttons, 0x80000001u);
    EXPECT_TRUE(spacenav::apply(event({2, 31}), state));
    EXPECT_EQ(state.buttons, 1u);
    const State before = state;
    EXPECT_FALSE(spacenav::apply(event({1, 32}), state));
    EXPECT_FALSE(spacenav::apply(event({2, -1}), state));
    EXPECT_FALSE(spacenav::apply(event({7, 1}), state));
    EXPECT_EQ(state, before);
}

TEST(SpacenavCodec, NoBytesGiveAValueOutOfRange) {
    std::mt19937_64 random(3);
    State state;
    for (int i = 0; i < 1'000'000; ++i) {
        std::array<int32_t, 8> numbers;
        for (int32_t& number : numbers)
            number = static_cast<int32_t>(random());
        if (random() % 4)
            numbers[0] = static_cast<int32_t>(random() % 3);
        spacenav::apply(event(numbers), state);
        for (const int axis : state.axes)
            ASSERT_LE(std::abs(axis), kRange);
    }
}

TEST(Spacenav, EventsMoveTheHandHoweverTheyAreCut) {
    for (const size_t piece : {size_t{1}, size_t{7}, kEvent, 3 * kEvent}) {
        int ends[2];
        ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
        Fd daemon(ends[0]);
        SpacenavDevice device{Fd(ends[1])};
        std::vector<std::byte> stream;
        for (const Event& e : {event({0, 175, 350, -350, 0, 350, 0, 8}), event({1, 2}),
                               event({0, 175, 350, -350, 0, 350, 0, 8})})
            stream.insert(stream.end(), e.begin(), e.end());
        DeviceSample sample;
        EXPECT_EQ(device.read(kMs, sample), DeviceStatus::ok);
        for (size_t at = 0; at < stream.size(); at += piece) {
            const size_t size = std::min(piece, stream.size() - at);
            ASSERT_EQ(::send(daemon.get(), stream.data() + at, size, 0),
                      static_cast<ssize_t>(size));
            ASSERT_EQ(device.read(kMs, sample), DeviceStatus::ok);
        }
        const glm::dvec3 begin = sample.position_m;
        for (int tick = 2; tick <= 101; ++tick)
            ASSERT_EQ(device.read(tick * kMs, sample), DeviceStatus::ok);
        // Half to the right, up, and towards the person; and a turn about the vertical.
        const glm::dvec3 way_m = sample.position_m - begin;
        EXPECT_NEAR(way_m.x, 0.05 * RateHand::kSpeed_m_per_s, 1e-9);
        EXPECT_NEAR(way_m.y, 0.1 * RateHand::kSpeed_m_per_s, 1e-9);
        EXPECT_NEAR(way_m.z, 0.1 * RateHand::kSpeed_m_per_s, 1e-9);
        EXPECT_NEAR(glm::axis(sample.rotation).y, -1.0, 1e-9);
        EXPECT_EQ(sample.buttons, 4u);
        daemon = Fd();
        EXPECT_EQ(device.read(102 * kMs, sample), DeviceStatus::gone);
    }
    EXPECT_THAT(SpacenavDevice::open("/none/spnav.sock").error().message,
                ::testing::HasSubstr("spacenavd does not answer"));
}

} // namespace
} // namespace palpate::haptics
