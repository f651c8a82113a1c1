#include "haptics/device/wooden/wooden.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "haptics/device/simulated.h"
#include "tests/unit/haptics_hands/fake_wooden.h"

namespace palpate::haptics {
namespace {

using namespace wooden;

constexpr int64_t kMs = 1'000'000;
const Geometry* const kGeometries[] = {&kWoodenHaptics, &kPolhem};

TEST(WoodenCodec, EveryReportReadsBackAsItWasWritten) {
    const std::array stop = encode(Command{});
    EXPECT_TRUE(
        std::all_of(stop.begin(), stop.end(), [](std::byte b) { return b == std::byte{}; }));
    const auto bytes = encode(Command{{1, -2, 300}, kSetEncoders, {0, 0, -1}});
    const std::array<unsigned, kReport> expected{1, 0, 0xFE, 0xFF, 0x2C, 1,    1,
                                                 0, 0, 0,    0,    0,    0xFF, 0xFF};
    for (size_t i = 0; i < kReport; ++i)
        EXPECT_EQ(std::to_integer<unsigned>(bytes[i]), expected[i]) << i;
    std::mt19937_64 random(11);
    for (int i = 0; i < 1'000'000; ++i) {
        std::array<std::byte, 64> report;
        for (std::byte& byte : report)
            byte = static_cast<std::byte>(random());
        const size_t size = random() % 65;
        State state, unread;
        Command command;
        const auto told = std::span(report).first(size);
        ASSERT_EQ(decode(told, state), size >= kReport);
        ASSERT_EQ(decode(told, command), size >= kReport);
        if (size < kReport) {
            ASSERT_EQ(state, unread);
            continue;
        }
        const auto again = encode(state), and_again = encode(command);
        ASSERT_TRUE(std::equal(again.begin(), again.end(), report.begin()));
        ASSERT_TRUE(std::equal(and_again.begin(), and_again.end(), report.begin()));
    }
}

TEST(WoodenKinematics, AtItsStopsTheLinksHang) {
    // Both links on the vertical: the grip below the top of the upper one.
    for (const Geometry* g : kGeometries) {
        const glm::dvec3 rest = forward(*g, {0, 0, 0});
        EXPECT_NEAR(rest.x, 0.0, 1e-12);
        EXPECT_NEAR(rest.y, g->post_m + g->upper_m - g->lower_m - g->middle_m.z, 1e-12);
        EXPECT_NEAR(rest.z, -g->middle_m.x, 1e-12);
        // Leaning out by a right angle, the upper link's length nearer to the person.
        const glm::dvec3 out = forward(*g, {0, 0.5 * 3.14159265358979, 0});
        EXPECT_NEAR(out.z, g->upper_m - g->middle_m.x, 1e-9);
    }
}

TEST(WoodenKinematics, PositionsAnglesAndForcesAgree) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> in_box(-0.08, 0.08), any(-1, 1);
    for (const Geometry* g : kGeometries)
        for (int i = 0; i < 20'000; ++i) {
            const glm::dvec3 place{in_box(random), in_box(random), in_box(random)};
            const std::optional<Angles> angles = inverse(*g, place);
            ASSERT_TRUE(angles);
            ASSERT_LT(glm::length(forward(*g, *angles) - place), 1e-12);
            const glm::dmat3 by_angle = jacobian(*g, *angles);
            constexpr double kStep = 1e-6; // differences are right to its square
            for (int axis = 0; axis < 3; ++axis) {
                Angles more = *angles, less = *angles;
                more[static_cast<size_t>(axis)] += kStep;
                less[static_cast<size_t>(axis)] -= kStep;
                const glm::dvec3 slope = (forward(*g, more) - forward(*g, less)) / (2 * kStep);
                ASSERT_LT(glm::length(by_angle[axis] - slope), 1e-9);
            }
            // The motors' work is what the hand gets.
            const glm::dvec3 force{any(random), any(random), any(random)},
                turn{any(random), any(random), any(random)}; // of the bodies
            const glm::dvec3 amperes = currents(*g, *angles, force);
            double motors_w = 0.0;
            for (int axis = 0; axis < 3; ++axis)
                motors_w += amperes[axis] * g->torque_nm_per_a * turn[axis] /
                            g->ratio[static_cast<size_t>(axis)];
            ASSERT_NEAR(motors_w, glm::dot(force, by_angle * turn), 1e-12);
            // Encoders: to half a step.
            const auto counts = counts_of(*g, *angles);
            ASSERT_TRUE(counts);
            const Angles stepped = angles_of(*g, {(*counts)[0], (*counts)[1], (*counts)[2]});
            ASSERT_LT(glm::length(forward(*g, stepped) - place),
                      1.8 * wooden_capabilities(*g).resolution_m);
        }
    EXPECT_FALSE(inverse(kPolhem, {0, 0, 1}));
    EXPECT_FALSE(inverse(kPolhem, {0, NAN, 0}));
}

TEST(WoodenKinematics, NoForceAsksForMoreThanTheMotorsHave) {
    const Angles angles = *inverse(kPolhem, {0, 0, 0});
    std::mt19937_64 random(4);
    for (int i = 0; i < 100'000; ++i) {
        const double scale = std::pow(10.0, static_cast<double>(random() % 600) / 20.0 - 5.0);
        const glm::dvec3 force =
            scale * glm::dvec3(double(random() % 201) - 100, double(random() % 201) - 100,
                               double(random() % 201) - 100);
        const auto ma = WoodenDevice::motor_currents(kPolhem, angles, force);
        const glm::dvec3 exact = 1e3 * currents(kPolhem, angles, force);
        for (int axis = 0; axis < 3; ++axis) {
            const int current = ma[static_cast<size_t>(axis)];
            ASSERT_LE(std::abs(current), WoodenDevice::kMost_ma);
            if (std::abs(current) > 1) {
                ASSERT_GT(current * exact[axis], 0.0); // never turned round
            }
        }
    }
    EXPECT_EQ(WoodenDevice::motor_currents(kPolhem, angles, {NAN, 0, 0}),
              (std::array<int16_t, 3>{}));
    EXPECT_EQ(WoodenDevice::motor_currents(kPolhem, angles, {0, INFINITY, 0}),
              (std::array<int16_t, 3>{}));
}

struct Bench {
    VirtualClock clock;
    FakeWooden model;
    FakeTransport* transport = nullptr;
    explicit Bench(const Geometry& geometry = kWoodenHaptics)
        : model(geometry), geometry_(geometry) {}
    Result<std::unique_ptr<WoodenDevice>> open(size_t report_bytes = kReport) {
        auto made = std::make_unique<FakeTransport>(model, clock);
        transport = made.get();
        return WoodenDevice::open(std::move(made), geometry_, report_bytes);
    }
    DeviceStatus tick(WoodenDevice& device, DeviceSample& sample, glm::dvec3 force_n) {
        clock.sleep_until(clock.now_ns() + kMs);
        const DeviceStatus status = device.read(clock.now_ns(), sample);
        device.write(clock.now_ns(), {.force_n = force_n});
        transport->reap(0);
        return status;
    }

 private:
    const Geometry& geometry_;
};

TEST(Wooden, ItSaysWhereTheHandIsAndPushesAsTold) {
    for (const Geometry* g : kGeometries)
        for (const size_t report_bytes : {kReport, size_t{64}}) {
            Bench b(*g);
            Result<std::unique_ptr<WoodenDevice>> opened = b.open(report_bytes);
            ASSERT_TRUE(opened) << opened.error().message;
            WoodenDevice& device = **opened;
            b.model.place_m = {0.03, -0.02, 0.01};
            DeviceSample sample;
            for (int i = 0; i < 5; ++i)
                b.tick(device, sample, {1, -2, 0.5});
            EXPECT_LT(glm::length(sample.position_m - b.model.place_m),
                      1.8 * device.capabilities().resolution_m);
            EXPECT_EQ(b.model.sent.back().size(), 1 + report_bytes);
            // The motors' torques are those of the force, to the step of a mA.
            const Angles angles = *inverse(*g, sample.position_m);
            const glm::dvec3 ma = 1e3 * currents(*g, angles, {1, -2, 0.5});
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(b.model.command.motors_ma[static_cast<size_t>(axis)], ma[axis], 0.51);
            opened->reset();
            EXPECT_EQ(b.model.command.motors_ma, (std::array<int16_t, 3>{}));
        }
}

TEST(Wooden, CalibratedItCountsFromWhereItHangs) {
    Bench b;
    WoodenDevice& device = *b.open().value().release();
    const std::unique_ptr<WoodenDevice> owner(&device);
    b.model.place_m = forward(kWoodenHaptics, {0.001, 0.001, 0.001});
    b.model.zero = {400, -300, 77}; // wherever it woke up
    ASSERT_TRUE(device.calibrate());
    b.model.place_m = {0.01, 0.02, 0.03};
    DeviceSample sample;
    for (int i = 0; i < 3; ++i)
        b.tick(device, sample, {});
    EXPECT_LT(glm::length(sample.position_m - b.model.place_m), 1e-3);
}

TEST(Wooden, ForceEndsWhateverHappens) {
    Bench b;
    const std::unique_ptr<WoodenDevice> device = std::move(b.open().value());
    DeviceSample sample;
    const auto press = [&] {
        for (int i = 0; i < 3; ++i)
            b.tick(*device, sample, {0, 0, 2});
        EXPECT_NE(b.model.command.motors_ma, (std::array<int16_t, 3>{}));
    };
    press();
    device->halt(0); // past the driver
    b.transport->reap(0);
    EXPECT_EQ(b.model.command.motors_ma, (std::array<int16_t, 3>{}));
    press();
    b.model.advance(b.clock.now_ns() + 500 * kMs); // the program hangs: its own watchdog
    EXPECT_EQ(b.model.command.motors_ma, (std::array<int16_t, 3>{}));
    EXPECT_EQ(device->capabilities().watchdog_ns, 500 * kMs);
    press();
    // Reports that are too short say nothing, and for long nothing means gone.
    b.model.cut = 9;
    b.tick(*device, sample, {});
    EXPECT_EQ(b.tick(*device, sample, {}), DeviceStatus::stale);
    b.model.cut = 64;
    b.tick(*device, sample, {});
    EXPECT_EQ(b.tick(*device, sample, {}), DeviceStatus::ok);
    b.model.silent = true;
    DeviceStatus status = DeviceStatus::ok;
    for (int i = 0; i < 110; ++i)
        status = b.tick(*device, sample, {});
    EXPECT_EQ(status, DeviceStatus::gone);
    b.model.silent = false;
    for (int i = 0; i < 3; ++i)
        status = b.tick(*device, sample, {});
    EXPECT_EQ(status, DeviceStatus::ok);
    b.transport->unplug();
    EXPECT_EQ(b.tick(*device, sample, {}), DeviceStatus::gone);
    Bench silent;
    silent.model.silent = true;
    EXPECT_THAT(silent.open().error().message, ::testing::HasSubstr("WoodenHaptics: expected"));
    EXPECT_LT(silent.clock.now_ns(), 1000 * kMs);
}

} // namespace
} // namespace palpate::haptics
