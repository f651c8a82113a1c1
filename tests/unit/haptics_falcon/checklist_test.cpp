#include "haptics/device/checklist.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/haptics_falcon/falcon_bench.h"

// The owner's checklist on the model of a Falcon, and on a simulated device.
namespace palpate::haptics::falcon {
namespace {

using ::testing::HasSubstr;

struct Person {
    std::vector<std::string> told, asked;
    Owner owner() {
        return {.tell = [this](const std::string& what) { told.push_back(what); },
                .ask =
                    [this](const std::string& question) {
                        asked.push_back(question);
                        return "colour " + std::to_string(asked.size());
                    }};
    }
};

// A hand that holds the grip 5 mm off the middle, and follows a path in the second part.
HandPath to_and_fro() {
    std::vector<HandPose> poses;
    for (int i = 0; i <= 40; ++i)
        poses.push_back({.time_s = 2.2 + 0.05 * i,
                         .tool = {.position_mm = {0.5 * i, 5.0, i % 2 ? -4.0 : 4.0}}});
    return HandPath(std::move(poses));
}

TEST(Checklist, OnTheModelOfAFalconItSaysWhatIsThere) {
    FalconBench bench({.is_homed = false, .homing_packets = 300, .path = to_and_fro()});
    const std::unique_ptr<FalconDevice> device = std::move(bench.open().value());
    Person person;
    const Result<Checklist> list =
        run_checklist(*device, bench.clock, {.is_armed = true, .move_s = 3.0}, person.owner());
    ASSERT_TRUE(list) << list.error().message;
    EXPECT_FALSE(list->was_homed);
    EXPECT_NEAR(list->homed_s, 0.3, 0.2); // 300 packets of about a millisecond
    // 16 bytes each way at 1.5 Mbaud, and the host's looks every 50 us.
    EXPECT_GT(list->times.count, 1990u);
    EXPECT_GT(list->times.p50_ms, 0.2);
    EXPECT_LT(list->times.p99_ms, 1.1);
    uint32_t sum = 0;
    for (const uint32_t bin : list->times.bins)
        sum += bin;
    EXPECT_EQ(sum, list->times.count);
    // Each light was alone on, and the answers are kept.
    ASSERT_EQ(list->lights.size(), 3u);
    EXPECT_EQ(list->lights[0], (std::pair<int, std::string>(kGreen, "colour 1")));
    EXPECT_EQ(list->lights[2], (std::pair<int, std::string>(kRed, "colour 3")));
    EXPECT_GT(list->ends.high_mm.x - list->ends.low_mm.x, 10.0);
    EXPECT_GT(list->ends.step_mm.x, 0.0);
    EXPECT_LT(list->ends.step_mm.x, 0.2);
    // Every push moves the grip its way.
    ASSERT_EQ(list->pushes.size(), 6u);
    for (const Checklist::Push& push : list->pushes) {
        EXPECT_GT(push.delay_ms, 0.0);
        EXPECT_LT(push.delay_ms, 40.0);
        EXPECT_FALSE(push.was_stopped);
        EXPECT_GT(push.moved_mm.back(), 0.1);
        EXPECT_LT(push.moved_mm.back(), Checklist::kFarthest_mm);
        EXPECT_LT(push.across_mm, 0.5 * push.moved_mm.back());
    }
    bench.pass(10 * kMs);
    EXPECT_EQ(bench.model.command().motors, (Counts{})); // and none afterwards
    EXPECT_THAT(person.told, ::testing::Contains(HasSubstr("all the way out")));
}

TEST(Checklist, WithoutArmingThereIsNoForce) {
    FalconBench bench;
    const std::unique_ptr<FalconDevice> device = std::move(bench.open().value());
    bool was_pushed = false;
    bench.transport->set_fault([&](Transfer& t, int64_t) {
        Command command;
        if (!t.is_in() && t.size == kPacket &&
            decode(std::span<const std::byte, kPacket>(t.bytes.data(), kPacket), command))
            was_pushed = was_pushed || command.motors != Counts{};
    });
    Person person;
    const Result<Checklist> list =
        run_checklist(*device, bench.clock, {.move_s = 0.0}, person.owner());
    ASSERT_TRUE(list) << list.error().message;
    EXPECT_TRUE(list->was_homed);
    EXPECT_TRUE(list->pushes.empty());
    EXPECT_FALSE(was_pushed);
}

TEST(Checklist, ADeviceThatGoesAwayEndsIt) {
    for (const int after : {3, 500, 2300, 3200}) {
        FalconBench bench;
        const std::unique_ptr<FalconDevice> device = std::move(bench.open().value());
        int transfers = 0;
        bench.transport->set_fault([&](Transfer&, int64_t) {
            if (++transfers == after)
                bench.transport->unplug();
        });
        Person person;
        const Result<Checklist> list =
            run_checklist(*device, bench.clock, {.is_armed = true, .move_s = 0.0}, person.owner());
        ASSERT_FALSE(list) << after;
        EXPECT_THAT(list.error().message, HasSubstr("Novint Falcon: unplugged"));
    }
    FalconBench bench({.is_homed = false, .homing_packets = 1'000'000});
    const std::unique_ptr<FalconDevice> device = std::move(bench.open().value());
    Person person;
    EXPECT_THAT(
        run_checklist(*device, bench.clock, {.homing_s = 2.0}, person.owner()).error().message,
        HasSubstr("not homed within 2 s"));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_THAT(
        run_checklist(*device, bench.clock, {}, person.owner(), stop.get_token()).error().message,
        HasSubstr("interrupted"));
}

// Nobody holds it and it is light: the push ends before it gets anywhere.
TEST(Checklist, WhatGoesTooFastIsLetGo) {
    DevicePreset preset = *find_device_preset("ideal");
    preset.plant.mass_kg = 0.02;
    SimulatedDevice device(preset, {.grip = 0.0}, HandPath({HandPose{}}), Workspace({0, 0, 0}, 1));
    VirtualClock clock;
    Person person;
    const Result<Checklist> list =
        run_checklist(device, clock, {.is_armed = true, .move_s = 0.0}, person.owner());
    ASSERT_TRUE(list) << list.error().message;
    ASSERT_EQ(list->pushes.size(), 6u);
    for (const Checklist::Push& push : list->pushes)
        EXPECT_TRUE(push.was_stopped);
    EXPECT_LT(glm::length(device.true_velocity_m_per_s()), 1.0);
}

} // namespace
} // namespace palpate::haptics::falcon
