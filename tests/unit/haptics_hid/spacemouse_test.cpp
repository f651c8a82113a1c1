#include "haptics/device/spacemouse/spacemouse.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>

#include "haptics/device/transport/fake_transport.h"

namespace palpate::haptics {
namespace {

using namespace spacemouse;

constexpr int64_t kMs = 1'000'000;
using Bytes = std::vector<std::byte>;

Bytes bytes(std::initializer_list<int> values) {
    Bytes all;
    for (const int value : values)
        all.push_back(static_cast<std::byte>(value));
    return all;
}

// As the HID standard's tables encode it: six axes of -500 .. 500 in report 1, 32 buttons in report
// 3, a light in report 4.
Bytes descriptor(int usage = 8, int range = 500) {
    return bytes({0x05,
                  0x01,
                  0x09,
                  usage,
                  0xA1,
                  0x01,
                  0xA1,
                  0x00,
                  0x85,
                  0x01,
                  0x16,
                  -range & 0xFF,
                  (-range >> 8) & 0xFF,
                  0x26,
                  range & 0xFF,
                  range >> 8,
                  0x36,
                  0x88,
                  0xFA,
                  0x46,
                  0x78,
                  0x05,
                  0x09,
                  0x30,
                  0x09,
                  0x31,
                  0x09,
                  0x32,
                  0x09,
                  0x33,
                  0x09,
                  0x34,
                  0x09,
                  0x35,
                  0x75,
                  0x10,
                  0x95,
                  0x06,
                  0x81,
                  0x02,
                  0xC0,
                  0xA1,
                  0x02,
                  0x85,
                  0x03,
                  0x05,
                  0x09,
                  0x19,
                  0x01,
                  0x29,
                  0x20,
                  0x15,
                  0x00,
                  0x25,
                  0x01,
                  0x75,
                  0x01,
                  0x95,
                  0x20,
                  0x81,
                  0x02,
                  0xC0,
                  0x85,
                  0x04,
                  0x05,
                  0x08,
                  0x09,
                  0x4B,
                  0x26,
                  0xFF,
                  0x7F,
                  0x91,
                  0x02,
                  0xC0});
}

TEST(SpaceMouseCodec, BothLayoutsGiveTheSameState) {
    const State expected{.axes = {100, -2, 350, -350, 0, 17}};
    State split, merged;
    EXPECT_EQ(decode(bytes({1, 100, 0, 0xFE, 0xFF, 0x5E, 0x01}), 350, split), Told::axes);
    EXPECT_EQ(decode(bytes({2, 0xA2, 0xFE, 0, 0, 17, 0}), 350, split), Told::axes);
    EXPECT_EQ(
        decode(bytes({1, 100, 0, 0xFE, 0xFF, 0x5E, 0x01, 0xA2, 0xFE, 0, 0, 17, 0}), 350, merged),
        Told::axes);
    EXPECT_EQ(split, expected);
    EXPECT_EQ(merged, expected);
}

TEST(SpaceMouseCodec, ButtonsBatteryAndOtherReports) {
    State state;
    EXPECT_EQ(decode(bytes({3, 0x05}), 350, state), Told::buttons);
    EXPECT_EQ(state.buttons, 5u);
    EXPECT_EQ(decode(bytes({3, 1, 0, 0x40, 0x80, 0xFF}), 350, state), Told::buttons);
    EXPECT_EQ(state.buttons, 0x80400001u);
    EXPECT_EQ(decode(bytes({0x17, 63, 1}), 350, state), Told::battery);
    EXPECT_EQ(state.battery_percent, 63);
    EXPECT_TRUE(state.is_charging);
    const State before = state;
    for (const Bytes& other :
         {bytes({}), bytes({1}), bytes({1, 2, 3, 4, 5, 6}), bytes({2, 1}), bytes({3}),
          bytes({0x17, 101, 0}), bytes({0x17, 1}), bytes({9, 1, 2, 3, 4, 5, 6, 7, 8})})
        EXPECT_EQ(decode(other, 350, state), Told::nothing);
    EXPECT_EQ(state, before);
    // Beyond the range that the descriptor names.
    decode(bytes({1, 0xFF, 0x7F, 0x00, 0x80, 0, 0}), 350, state);
    EXPECT_EQ(state.axes[0], 350);
    EXPECT_EQ(state.axes[1], -350);
}

TEST(SpaceMouseCodec, ADescriptorTellsKindAndRange) {
    const Description six = describe(descriptor());
    EXPECT_TRUE(six.is_six_axis);
    EXPECT_EQ(six.range, 500);
    EXPECT_FALSE(describe(descriptor(/*usage=*/2)).is_six_axis); // a mouse of the same maker
    EXPECT_EQ(describe({}).range, 350);
    EXPECT_FALSE(describe({}).is_six_axis);
}

TEST(SpaceMouseCodec, NoBytesGiveAValueOutOfRange) {
    std::mt19937_64 random(21);
    const Bytes whole = descriptor();
    for (int i = 0; i < 300'000; ++i) {
        Bytes report(random() % 20);
        for (std::byte& byte : report)
            byte = static_cast<std::byte>(random());
        if (!report.empty() && random() % 2)
            report[0] = static_cast<std::byte>(std::array{1, 2, 3, 0x17}[random() % 4]);
        State state;
        decode(report, 350, state);
        for (const int axis : state.axes)
            ASSERT_LE(std::abs(axis), 350);
        ASSERT_LE(state.battery_percent, 100);
        Bytes damaged(whole.begin(), whole.begin() + static_cast<long>(random() % whole.size()));
        for (int n = 0; n < 3 && !damaged.empty(); ++n)
            damaged[random() % damaged.size()] = static_cast<std::byte>(random());
        const int range = describe(damaged).range;
        ASSERT_TRUE(range > 0 && range <= 32767);
    }
}

// Sends the reports that it is given at their times.
class FakeSpaceMouse final : public FakePeer {
 public:
    std::deque<std::pair<int64_t, Bytes>> reports;
    Bytes last;
    void advance(int64_t to_ns) override { now_ns_ = to_ns; }
    bool control(const UsbSetup&, std::span<const std::byte>) override { return true; }
    bool out(uint8_t, std::span<const std::byte> report) override {
        last.assign(report.begin(), report.end());
        return true;
    }
    int in(uint8_t, std::span<std::byte> room) override {
        if (reports.empty() || reports.front().first > now_ns_)
            return -1;
        const Bytes report = std::move(reports.front().second);
        reports.pop_front();
        std::copy(report.begin(), report.end(), room.begin());
        return static_cast<int>(report.size());
    }
    void plugged() override {}

 private:
    int64_t now_ns_ = 0;
};

TEST(SpaceMouse, APushMovesTheHandAndSilenceEndsIt) {
    for (const bool is_split : {false, true}) {
        VirtualClock clock;
        FakeSpaceMouse model;
        auto made = std::make_unique<FakeTransport>(model, clock);
        FakeTransport& transport = *made;
        auto device = std::make_unique<SpaceMouseDevice>(std::move(made), describe(descriptor()));
        EXPECT_EQ(model.last, bytes({4, 1}));
        // Half of the deflection to the right and down, and a turn, for 100 ms; then nothing.
        for (int i = 0; i < 100; i += 8) {
            const int64_t at_ns = (10 + i) * kMs;
            if (is_split) {
                model.reports.push_back({at_ns, bytes({1, 250, 0, 0, 0, 250, 0})});
                model.reports.push_back({at_ns, bytes({2, 0, 0, 0, 0, 0xF4, 0x01})});
            } else {
                model.reports.push_back(
                    {at_ns, bytes({1, 250, 0, 0, 0, 250, 0, 0, 0, 0, 0, 0xF4, 0x01})});
            }
        }
        model.reports.push_back({60 * kMs, bytes({3, 2})});
        std::sort(model.reports.begin(), model.reports.end(),
                  [](const auto& a, const auto& b) { return a.first < b.first; });
        DeviceSample sample;
        glm::dvec3 fastest(0.0);
        for (int tick = 1; tick <= 400; ++tick) {
            clock.sleep_until(tick * kMs);
            ASSERT_EQ(device->read(clock.now_ns(), sample), DeviceStatus::ok);
            fastest = glm::max(fastest, glm::abs(sample.velocity_m_per_s));
        }
        // 0.05 m/s from 10 to 106 ms, and 50 ms of patience more.
        EXPECT_NEAR(sample.position_m.x, 0.05 * 0.147, 0.05 * 0.004);
        EXPECT_NEAR(sample.position_m.y, -0.05 * 0.147, 0.05 * 0.004); // down
        EXPECT_EQ(sample.position_m.z, 0.0);
        EXPECT_NEAR(fastest.x, 0.05, 1e-9);
        EXPECT_EQ(sample.velocity_m_per_s, glm::dvec3(0));
        EXPECT_NEAR(glm::angle(sample.rotation), 1.5 * 0.147, 1.5 * 0.004);
        EXPECT_NEAR(glm::axis(sample.rotation).y, -1.0, 1e-9);
        EXPECT_EQ(sample.buttons, 2u);
        transport.unplug();
        EXPECT_EQ(device->read(401 * kMs, sample), DeviceStatus::gone);
        EXPECT_EQ(device->write(401 * kMs, {}), DeviceStatus::gone);
    }
}

TEST(SpaceMouse, TheHandStaysWithinItsWorkspace) {
    VirtualClock clock;
    FakeSpaceMouse model;
    SpaceMouseDevice device(std::make_unique<FakeTransport>(model, clock), describe(descriptor()));
    DeviceSample sample;
    for (int tick = 1; tick <= 2000; ++tick) {
        clock.sleep_until(tick * kMs);
        if (tick % 8 == 0)
            model.reports.push_back({tick * kMs, bytes({1, 0xF4, 0x01, 0, 0, 0, 0})});
        ASSERT_EQ(device.read(clock.now_ns(), sample), DeviceStatus::ok);
        ASSERT_LE(sample.position_m.x, 0.05);
    }
    EXPECT_EQ(sample.position_m.x, 0.05);
    EXPECT_EQ(sample.velocity_m_per_s.x, 0.0); // at the wall
    ASSERT_TRUE(device.calibrate());
    device.read(2001 * kMs, sample);
    EXPECT_LT(sample.position_m.x, 0.001);
}

} // namespace
} // namespace palpate::haptics
