#include "haptics/device/gamepad/gamepad.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/input.h>
#include <unistd.h>

#include <random>

namespace palpate::haptics {
namespace {

using namespace gamepad;

constexpr int64_t kMs = 1'000'000;

constexpr Ranges kRanges{{{-32768, 32767, 128},
                          {-32768, 32767, 128},
                          {-32768, 32767, 128},
                          {0, 255, 15},
                          {-1, 1, 0},
                          {-1, 1, 0}}};

TEST(GamepadCodec, AxesAreSharesBeyondTheirRest) {
    State state;
    EXPECT_TRUE(gamepad::apply(EV_ABS, ABS_X, 32767, kRanges, state));
    EXPECT_EQ(state.axes[0], 1.0);
    EXPECT_TRUE(gamepad::apply(EV_ABS, ABS_X, 100, kRanges, state));
    EXPECT_EQ(state.axes[0], 0.0);
    EXPECT_TRUE(gamepad::apply(EV_ABS, ABS_Y, -32768, kRanges, state));
    EXPECT_EQ(state.axes[1], -1.0);
    // From 0 to 255: the middle is 127.5, and 15 about it is rest.
    EXPECT_TRUE(gamepad::apply(EV_ABS, ABS_RY, 200, kRanges, state));
    EXPECT_DOUBLE_EQ(state.axes[3], (200 - 127.5 - 15) / (127.5 - 15));
    EXPECT_TRUE(gamepad::apply(EV_ABS, ABS_HAT0X, -1, kRanges, state));
    EXPECT_EQ(state.axes[4], -1.0);
    EXPECT_TRUE(gamepad::apply(EV_KEY, BTN_SOUTH, 1, kRanges, state));
    EXPECT_TRUE(gamepad::apply(EV_KEY, BTN_START, 1, kRanges, state));
    EXPECT_EQ(state.buttons, 1u | 1u << (BTN_START - BTN_SOUTH));
    EXPECT_TRUE(gamepad::apply(EV_KEY, BTN_SOUTH, 0, kRanges, state));
    EXPECT_EQ(state.buttons, 1u << (BTN_START - BTN_SOUTH));
    const State before = state;
    EXPECT_FALSE(gamepad::apply(EV_ABS, ABS_Z, 100, kRanges, state)); // a trigger
    EXPECT_FALSE(gamepad::apply(EV_KEY, KEY_A, 1, kRanges, state));
    EXPECT_FALSE(gamepad::apply(EV_SYN, 0, 0, kRanges, state));
    EXPECT_EQ(state, before);
}

TEST(GamepadCodec, NoEventGivesAValueOutOfRange) {
    std::mt19937_64 random(5);
    State state;
    for (int i = 0; i < 1'000'000; ++i) {
        Ranges ranges = kRanges;
        const auto low = static_cast<int>(random()), high = static_cast<int>(random());
        if (low < high)
            ranges[random() % kAxes] = {low, high, static_cast<int>(random())};
        const uint16_t code =
            random() % 2 ? kAxisCodes[random() % kAxes] : static_cast<uint16_t>(random() % 0x300);
        gamepad::apply(static_cast<uint16_t>(random() % 5), code, static_cast<int32_t>(random()),
                       ranges, state);
        for (const double axis : state.axes)
            ASSERT_TRUE(axis >= -1.0 && axis <= 1.0) << axis;
        ASSERT_LT(state.buttons, 1u << 16);
    }
}

TEST(GamepadCodec, OnlyGamepadsHaveAGamepadsButtons) {
    EXPECT_TRUE(is_gamepad("7cdb000000000000 0 0 0 0\n")); // as an Xbox pad's: BTN_SOUTH and others
    EXPECT_FALSE(is_gamepad("1f0000 0 0 0 0\n"));          // a mouse
    EXPECT_FALSE(is_gamepad("402000000 3803078f800d001 feffffdfffefffff fffffffffffffffe\n"));
    EXPECT_FALSE(is_gamepad(""));
    EXPECT_FALSE(is_gamepad("not a number"));
}

TEST(Gamepad, SticksMoveTheHandAndAnUnpluggedOneIsGone) {
    int ends[2];
    ASSERT_EQ(::pipe2(ends, O_NONBLOCK | O_CLOEXEC), 0);
    Fd pad(ends[1]);
    GamepadDevice device{Fd(ends[0]), kRanges};
    const auto send = [&](uint16_t type, uint16_t code, int value) {
        const input_event event{.time = {}, .type = type, .code = code, .value = value};
        ASSERT_EQ(::write(pad.get(), &event, sizeof(event)), ssize_t{sizeof(event)});
    };
    DeviceSample sample;
    EXPECT_EQ(device.read(kMs, sample), DeviceStatus::ok);
    send(EV_ABS, ABS_X, 32767);
    send(EV_ABS, ABS_Y, -32768); // up
    send(EV_ABS, ABS_RY, 255);   // towards the person
    send(EV_ABS, ABS_RX, -32768);
    send(EV_KEY, BTN_SOUTH, 1);
    for (int tick = 2; tick <= 101; ++tick)
        ASSERT_EQ(device.read(tick * kMs, sample), DeviceStatus::ok);
    const double way_m = 0.1 * RateHand::kSpeed_m_per_s;
    EXPECT_NEAR(sample.position_m.x, way_m, 1e-9);
    EXPECT_NEAR(sample.position_m.y, way_m, 1e-9);
    EXPECT_NEAR(sample.position_m.z, way_m, 1e-9);
    // To the left: turned about the vertical as seen from above, against the clock.
    EXPECT_NEAR(glm::angle(sample.rotation), 0.1 * RateHand::kTurn_rad_per_s, 1e-6);
    EXPECT_NEAR(glm::axis(sample.rotation).y, 1.0, 1e-9);
    EXPECT_EQ(sample.buttons, 1u);
    pad = Fd();
    EXPECT_EQ(device.read(102 * kMs, sample), DeviceStatus::gone);
    EXPECT_EQ(device.write(102 * kMs, {}), DeviceStatus::gone);
    EXPECT_FALSE(GamepadDevice::open("/dev/input/none"));
}

} // namespace
} // namespace palpate::haptics
