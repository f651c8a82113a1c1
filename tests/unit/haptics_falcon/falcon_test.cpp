#include "haptics/device/falcon/falcon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "tests/unit/haptics_falcon/falcon_bench.h"

namespace palpate::haptics::falcon {
namespace {

using ::testing::HasSubstr;

TEST(Falcon, FirmwareThatRunsIsLeftAlone) {
    FalconBench bench;
    const Result<std::unique_ptr<FalconDevice>> device = bench.open();
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_EQ((*device)->started(), Started::was_running);
    EXPECT_EQ(bench.model.latency_ms(), 1);
    EXPECT_LT(bench.clock.now_ns(), 20 * kMs);
}

TEST(Falcon, FirmwareIsLoadedAndEveryByteCompared) {
    const std::vector<std::byte> image = test_firmware();
    FalconBench bench({.firmware = image, .is_loaded = false});
    const Result<std::unique_ptr<FalconDevice>> device = bench.open(image);
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_EQ((*device)->started(), Started::loaded);
    EXPECT_TRUE(bench.model.runs());
    // 8492 bytes out at 140 kbaud are 0.6 s.
    EXPECT_GT(bench.clock.now_ns(), 600 * kMs);
    EXPECT_LT(bench.clock.now_ns(), 2000 * kMs);
    // Lost with the power, and loaded again.
    bench.model.plugged();
    EXPECT_FALSE(bench.model.runs());
    EXPECT_TRUE(bench.open(image));
}

TEST(Falcon, WhyItDoesNotStartIsSaid) {
    const std::vector<std::byte> image = test_firmware();
    const auto why = [&](FakeFalconSetup setup, std::span<const std::byte> firmware,
                         const FakeTransport::Fault& fault) {
        FalconBench bench(std::move(setup));
        const Result<std::unique_ptr<FalconDevice>> device = bench.open(firmware, fault);
        EXPECT_LT(bench.clock.now_ns(), 3000 * kMs);
        return device ? std::string() : device.error().message;
    };
    const FakeFalconSetup bare{.firmware = image, .is_loaded = false};
    EXPECT_THAT(why(bare, {}, nullptr), HasSubstr("no firmware is loaded"));
    std::vector<std::byte> another = image;
    another[5000] ^= std::byte{1};
    EXPECT_THAT(why(bare, another, nullptr), HasSubstr("does not run"));
    EXPECT_THAT(why(bare, image,
                    [](Transfer& t, int64_t) {
                        if (t.is_in() && t.moved == 64)
                            t.bytes[30] ^= std::byte{4};
                    }),
                HasSubstr("byte 28 of 8492 came back changed"));
    EXPECT_THAT(
        why(bare, image, [](Transfer& t, int64_t) { t.moved = std::min<size_t>(t.moved, 2); }),
        HasSubstr("boot program does not answer; is its power supply plugged in?"));
    EXPECT_THAT(why(bare, image,
                    [](Transfer& t, int64_t) {
                        if (t.kind == TransferKind::control)
                            t.status = TransferStatus::stalled;
                    }),
                HasSubstr("stall"));
}

TEST(Falcon, AFileThatIsNoFirmwareIsRefused) {
    const std::filesystem::path path =
        std::filesystem::path(::testing::TempDir()) / "falcon_firmware.bin";
    const auto why = [&](const std::string& bytes) {
        std::ofstream(path, std::ios::binary) << bytes;
        const Result<std::vector<std::byte>> read = load_firmware(path);
        return read ? std::string() : read.error().message;
    };
    EXPECT_THAT(why("short"), HasSubstr("4096 to 32768 bytes, found 5"));
    EXPECT_THAT(why(std::string(40000, '\1')), HasSubstr("found more than 32768"));
    EXPECT_THAT(why(std::string(8000, 'x')), HasSubstr("found text"));
    EXPECT_EQ(why(std::string(8000, '\1')), "");
    std::filesystem::remove(path);
    EXPECT_THAT(load_firmware(path).error().message, HasSubstr("falcon_firmware.bin"));
}

// Ticks a device at 1 kHz without a servo.
DeviceStatus tick(FalconBench& bench, FalconDevice& device, DeviceSample& sample,
                  const Wrench& wrench = {}) {
    const int64_t due_ns = bench.clock.now_ns() + kMs;
    device.wait(due_ns + kMs);
    bench.clock.sleep_until(due_ns);
    const DeviceStatus status = device.read(bench.clock.now_ns(), sample);
    device.write(bench.clock.now_ns(), wrench);
    return status;
}

TEST(Falcon, UntilItIsHomedItGivesNoPlaceAndTakesNoForce) {
    FalconBench bench({.is_homed = false});
    auto device = std::move(bench.open().value());
    DeviceSample sample;
    for (int i = 0; i < 50; ++i)
        EXPECT_EQ(tick(bench, *device, sample, {{0, 0, 1}}), DeviceStatus::not_homed);
    EXPECT_EQ(bench.model.command().lights, kRed);
    ASSERT_TRUE(device->home());
    int ticks = 0;
    while (tick(bench, *device, sample, {{0, 0, 1}}) == DeviceStatus::not_homed) {
        EXPECT_EQ(bench.model.command().motors, (Counts{}));
        ASSERT_LT(++ticks, 1000);
    }
    EXPECT_GE(ticks, 190);
    EXPECT_LT(glm::length(sample.position_m), 1e-4);   // the middle, to an encoder's step
    EXPECT_EQ(sample.velocity_m_per_s, glm::dvec3(0)); // the jump of the encoders is no motion
    tick(bench, *device, sample, {{0, 0, 1}});
    tick(bench, *device, sample, {{0, 0, 1}});
    EXPECT_NE(bench.model.command().motors, (Counts{}));
    EXPECT_EQ(bench.model.command().lights, kGreen);
}

TEST(Falcon, PlacesButtonsAndForcesPassThroughTheBytes) {
    const HandPath path({{.time_s = 0, .tool = {.position_mm = {0, 0, 0}}},
                         {.time_s = 0.5, .tool = {.position_mm = {20, -15, 10}}}});
    FalconBench bench({.path = path, .hand = {.grip = 3.0}});
    auto device = std::move(bench.open().value());
    bench.model.buttons = 0b1010;
    DeviceSample sample;
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 before = bench.model.plant().true_position_m();
        ASSERT_EQ(tick(bench, *device, sample), DeviceStatus::ok) << i;
        const glm::dvec3 after = bench.model.plant().true_position_m();
        // An encoder's step of 48.5 um on each of three motors, and the way of a tick.
        ASSERT_LT(glm::distance(sample.position_m, after), 1.5e-4 + glm::distance(before, after));
    }
    EXPECT_EQ(sample.buttons, 0b1010u);
    EXPECT_GT(sample.position_m.x, 0.015);
    // Forces come out of the motors as they went in, to a count of 0.1 mN m: 1 N needs 70 mN m.
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    for (int i = 0; i < 300; ++i) {
        const glm::dvec3 force_n(share(random), share(random), share(random));
        tick(bench, *device, sample, {force_n});
        bench.pass(kMs / 4);
        EXPECT_LT(glm::distance(bench.model.motor_force_n(), force_n), 0.02);
    }
    EXPECT_EQ(device->counters().lost_bytes, 0u);
    EXPECT_EQ(device->counters().failures, 0u);
}

TEST(Falcon, AnyForceIsScaledDownAndKeepsItsDirection) {
    std::mt19937_64 random(9);
    std::normal_distribution<double> number;
    for (int i = 0; i < 20'000; ++i) {
        const glm::dvec3 place =
            0.03 * glm::dvec3(std::sin(i), std::sin(1.3 * i), std::sin(1.7 * i));
        const double size = std::exp2(0.001 * i - 5.0); // to 30 kN
        const glm::dvec3 force_n =
            size * glm::normalize(glm::dvec3(number(random), number(random), number(random)));
        const Counts counts = FalconDevice::motor_counts(place, force_n);
        for (const int count : counts)
            ASSERT_LE(std::abs(count), FalconDevice::kMostCounts);
        const glm::dvec3 middle(0, 0, kCentre_m);
        const glm::dmat3 by_angle = *jacobian(*inverse(place + middle), place + middle);
        const glm::dvec3 acts = glm::inverse(glm::transpose(by_angle)) *
                                (glm::dvec3(counts[0], counts[1], counts[2]) / -10'000.0);
        const double acting = glm::length(acts);
        // Half a count on each motor is 1 mN.
        ASSERT_LT(glm::length(glm::cross(acts, force_n / size)), 3e-3);
        ASSERT_GT(glm::dot(acts, force_n), size > 0.1 ? 0.0 : -1e-3);
        if (size <= kForce_n) {
            ASSERT_NEAR(acting, size, 3e-3);
        }
    }
    EXPECT_EQ(FalconDevice::motor_counts({0, 0, 0}, {NAN, 0, 0}), (Counts{}));
    EXPECT_EQ(FalconDevice::motor_counts({0, 0, 0}, {INFINITY, 0, 0}), (Counts{}));
    EXPECT_EQ(FalconDevice::motor_counts({0, 0, 5}, {1, 0, 0}), (Counts{}));
}

TEST(Falcon, TheEventCharacterAnswersBeforeTheLatencyTimer) {
    FalconBench bench;
    auto device = std::move(bench.open().value());
    // With it an answer takes two packets of 16 bytes at 1.5 Mbaud, 0.22 ms, and polls.
    const auto answer_ns = [&] {
        const int64_t began_ns = bench.clock.now_ns();
        device->write(began_ns, {});
        EXPECT_TRUE(device->wait(began_ns + 20 * kMs));
        DeviceSample sample;
        device->read(bench.clock.now_ns(), sample);
        return bench.clock.now_ns() - began_ns;
    };
    int64_t longest_ns = 0;
    for (int i = 0; i < 50; ++i)
        longest_ns = std::max(longest_ns, answer_ns());
    EXPECT_LT(longest_ns, 400'000);
    bench.model.control(bridge_setup(BridgeRequest::event, 0), {});
    bench.model.control(bridge_setup(BridgeRequest::latency, 16), {});
    longest_ns = 0;
    for (int i = 0; i < 50; ++i)
        longest_ns = std::max(longest_ns, answer_ns());
    EXPECT_GT(longest_ns, 10 * kMs);
}

TEST(Falcon, UnpluggedItHasNoSampleAlsoWhereOneHadCome) {
    FalconBench bench;
    auto device = std::move(bench.open().value());
    device->write(bench.clock.now_ns(), {});
    ASSERT_TRUE(device->wait(bench.clock.now_ns() + 20 * kMs));
    bench.transport->unplug();
    EXPECT_FALSE(device->wait(bench.clock.now_ns() + 20 * kMs));
    DeviceSample sample;
    EXPECT_EQ(device->read(bench.clock.now_ns(), sample), DeviceStatus::gone);
}

TEST(Falcon, AHaltAndTheEndTakeForceAway) {
    FalconBench bench;
    auto device = std::move(bench.open().value());
    DeviceSample sample;
    tick(bench, *device, sample);
    for (int i = 0; i < 5; ++i)
        tick(bench, *device, sample, {{0, 0, 2}});
    EXPECT_GT(glm::length(bench.model.motor_force_n()), 1.0);
    device->write(bench.clock.now_ns(), {{0, 0, 2}});
    device->halt(bench.clock.now_ns());
    bench.pass(kMs / 2);
    EXPECT_EQ(bench.model.command().motors, (Counts{}));
    tick(bench, *device, sample);
    for (int i = 0; i < 5; ++i)
        tick(bench, *device, sample, {{0, 0, 2}});
    EXPECT_GT(glm::length(bench.model.motor_force_n()), 1.0);
    device.reset();
    bench.model.advance(bench.clock.now_ns() + kMs);
    EXPECT_EQ(bench.model.command().motors, (Counts{}));
}

} // namespace
} // namespace palpate::haptics::falcon
