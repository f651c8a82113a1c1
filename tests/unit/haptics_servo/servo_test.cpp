#include "haptics/servo/servo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "tests/unit/haptics_servo/bench_loop.h"

namespace palpate::haptics {
namespace {

// Above the wall at z = 5 mm for 2.5 s, then 4 mm into it.
HandPath into_the_wall() {
    return HandPath({{.time_s = 0, .tool = {.position_mm = {0, 0, 10}}},
                     {.time_s = 2.5, .tool = {.position_mm = {0, 0, 10}}},
                     {.time_s = 2.7, .tool = {.position_mm = {0, 0, 1}}}});
}

Loop wall_loop(const char* preset = "ideal", Servo::Options options = {}) {
    return {{.version = 5000},
            {.stiffness_n_per_m = 500.0},
            std::make_unique<WallAlgorithm>(),
            Loop::simulated(into_the_wall(), preset),
            options};
}

TEST(Servo, ForceOfTheTouchReachesTheDeviceInTheSameTick) {
    Loop loop = wall_loop();
    ServoTick t;
    for (int i = 0; i < 4000; ++i) {
        t = loop.tick();
        const auto& device = static_cast<SimulatedDevice&>(*loop.device);
        ASSERT_EQ(device.acting_force_n(), t.sent.force_n);
        ASSERT_EQ(t.tool.position_mm, 1e3 * device.true_position_m());
    }
    EXPECT_EQ(t.share, 1.0);
    EXPECT_EQ(t.faults, 0u);
    // At rest nothing is damped: the force is the spring's. The hand's spring balances it:
    // 500 d = 300 (4 mm - d), d = 1.5 mm.
    EXPECT_NEAR(t.sent.force_n.z, 0.5 * t.touched.depth_mm, 1e-6);
    EXPECT_NEAR(t.touched.depth_mm, 1.5, 1e-3);
    EXPECT_EQ(loop.servo.telemetry().ticks.load(), 4000u);
}

TEST(Servo, WorkspaceTurnsAndScales) {
    const glm::dquat quarter = glm::normalize(glm::dquat(1, 1, 0, 0)); // device y is world z
    const Workspace workspace({0, 0, 3}, 2.0, quarter);
    Mailbox<TouchScene> scenes(std::make_unique<const TouchScene>(TouchScene{.version = 5000}));
    Mailbox<TouchParameters> parameters(
        std::make_unique<const TouchParameters>(TouchParameters{.stiffness_n_per_m = 100.0}));
    WallAlgorithm wall;
    std::vector<DeviceRecord> records(3000);
    for (size_t i = 0; i < records.size(); ++i) {
        records[i].sample.time_ns = static_cast<int64_t>(i) * kTick_ns;
        // 2 mm up for 2.5 s, then slowly to 1 mm down: at world z = 3 - 2.
        records[i].sample.position_m.y =
            1e-3 * (2.0 - std::clamp((static_cast<double>(i) - 2500) / 100, 0.0, 3.0));
    }
    RecordedDevice device({.workspace_m = glm::dvec3(0.05), .max_force_n = 8}, records);
    Servo servo({device, wall, scenes, parameters, nullptr}, workspace, {});
    servo.arm();
    ServoTick t;
    for (int64_t i = 0; i < 3000; ++i)
        t = servo.tick(i * kTick_ns, i * kTick_ns);
    EXPECT_NEAR(t.tool.position_mm.z, 1.0, 1e-12);
    EXPECT_NEAR(t.sent.force_n.y, 0.4, 1e-12); // 100 N/m at 4 mm; not scaled
    EXPECT_NEAR(t.sent_world_n.z, 0.4, 1e-12);
}

TEST(Servo, EveryTickLeavesItsPose) {
    Loop loop = wall_loop();
    for (int i = 0; i < 100; ++i)
        loop.tick();
    ToolStamp stamp;
    for (int i = 0; i < 100; ++i) {
        ASSERT_TRUE(loop.poses.pop(stamp));
        EXPECT_EQ(stamp.time_ns, (i + 1) * kTick_ns);
        EXPECT_EQ(stamp.scene_version, 5000u);
    }
    EXPECT_FALSE(loop.poses.pop(stamp));
    for (int i = 0; i < 4100; ++i) // nobody takes them: refused, and said
        loop.tick();
    EXPECT_EQ(loop.servo.telemetry().poses_refused.load(), 4u);
}

TEST(Servo, NewParametersAreFeltGradually) {
    Loop loop = wall_loop();
    for (int i = 0; i < 4000; ++i)
        loop.tick();
    loop.parameters.publish(
        std::make_unique<const TouchParameters>(TouchParameters{.stiffness_n_per_m = 1000.0}));
    double before = loop.tick().touched.force_n.z;
    for (int i = 0; i < 30; ++i) {
        const double now = loop.tick().touched.force_n.z;
        // 5 % of 500 N/m at 1.5 mm, and what the hand moves meanwhile at well below 0.1 m/s.
        EXPECT_LE(std::abs(now - before), 25.0 * 1.5e-3 + 0.1);
        before = now;
    }
}

TEST(Servo, ClutchTakesForceAwayAndKeepsTheTool) {
    std::vector<HandPose> poses = into_the_wall().poses();
    poses.push_back({.time_s = 3.5, .tool = {.position_mm = {0, 0, 1}}, .buttons = 2});
    poses.push_back({.time_s = 3.7, .tool = {.position_mm = {0, 0, 8}}, .buttons = 2});
    Loop loop{{.version = 5000},
              {.stiffness_n_per_m = 500.0},
              std::make_unique<WallAlgorithm>(),
              Loop::simulated(HandPath(poses), "ideal"),
              {.clutch_button = 1}};
    ServoTick before, t;
    for (int i = 0; i < 3499; ++i)
        before = loop.tick();
    for (int i = 0; i < 500; ++i) {
        t = loop.tick();
        ASSERT_EQ(t.tool.position_mm.z, loop.tick().tool.position_mm.z);
    }
    EXPECT_NEAR(t.tool.position_mm.z, before.tool.position_mm.z, 0.05);
    EXPECT_EQ(t.sent.force_n, glm::dvec3(0));
}

TEST(Servo, EnergyIsTheWorkOfSentForces) {
    Loop loop = wall_loop();
    ServoTick t;
    for (int i = 0; i < 4000; ++i)
        t = loop.tick();
    // The device knows the work of held forces exactly; exact encoders see the same way.
    const auto& device = static_cast<SimulatedDevice&>(*loop.device);
    EXPECT_NEAR(t.energy_mj, 1e3 * device.motor_work_j(), 1e-9);
    EXPECT_LT(t.energy_mj, 0.0); // the hand has pressed a spring
}

// Every algorithm on a ball of samples, with a hand that slides over it.
std::vector<ServoTick> log_of(const AlgorithmEntry& entry, int ticks) {
    TouchParameters parameters;
    parameters.iso = 500.0;
    parameters.tool_radius_mm = 1.5;
    parameters.friction_static = parameters.friction_dynamic = 0.2;
    const HandPath path = find_trajectory("reach")->make(
        {.at_mm = {0, 0, 10}, .depth_mm = 2, .distance_mm = 5, .duration_s = 5});
    Servo::Options options;
    options.limits.ramp_s = 0.1;
    Loop loop{ball_scene(), parameters, entry.make(), Loop::simulated(path, "touch"), options};
    std::vector<ServoTick> log;
    for (int i = 0; i < ticks; ++i) {
        log.push_back(loop.tick());
        log.back().cpu_ns = 0; // the one thing that is measured and not computed
    }
    return log;
}

bool same_bits(double a, double b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

TEST(Servo, TheSameInputsGiveTheSameForcesBitForBitWithEveryAlgorithm) {
    for (const AlgorithmEntry& entry : algorithms()) {
        const std::vector<ServoTick> a = log_of(entry, 1500), b = log_of(entry, 1500);
        double most_n = 0.0;
        for (size_t i = 0; i < a.size(); ++i) {
            most_n = std::max(most_n, glm::length(a[i].sent.force_n));
            for (int axis = 0; axis < 3; ++axis) {
                ASSERT_TRUE(same_bits(a[i].sent.force_n[axis], b[i].sent.force_n[axis]))
                    << entry.name << ' ' << i;
                ASSERT_TRUE(same_bits(a[i].touched.proxy.position_mm[axis],
                                      b[i].touched.proxy.position_mm[axis]))
                    << entry.name << ' ' << i;
            }
            ASSERT_TRUE(same_bits(a[i].energy_mj, b[i].energy_mj)) << entry.name << ' ' << i;
        }
        EXPECT_TRUE(std::isfinite(most_n)) << entry.name;
    }
}

// A device whose hand is where it is told to be and that answers to forces as it is told to.
class Answering final : public HapticDevice {
 public:
    DeviceCapabilities about{.workspace_m = glm::dvec3(0.05), .max_force_n = 8};
    DeviceStatus answer = DeviceStatus::ok;
    double z_m = 0.01;
    const DeviceCapabilities& capabilities() const noexcept override { return about; }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override {
        sample = {.time_ns = now_ns, .position_m = {0, 0, z_m}};
        return DeviceStatus::ok;
    }
    DeviceStatus write(int64_t, const Wrench&) noexcept override { return answer; }
    void halt(int64_t) noexcept override {}
};

TEST(Servo, ADeviceThatIsGoneAtAWriteEndsForceThoughItStillGivesSamples) {
    auto owned = std::make_unique<Answering>();
    Answering& device = *owned;
    Loop loop{{.version = 5000}, {}, std::make_unique<WallAlgorithm>(), std::move(owned)};
    for (int i = 0; i < 2200; ++i)
        loop.tick();
    for (; device.z_m > 0.001; device.z_m -= 1e-5)
        loop.tick();
    EXPECT_GT(loop.tick().sent.force_n.z, 1.0);
    device.answer = DeviceStatus::gone;
    loop.tick();
    const ServoTick t = loop.tick();
    EXPECT_EQ(t.sent, Wrench{});
    EXPECT_EQ(t.faults, uint32_t{kFaultGone});
}

TEST(Servo, NoCouplingIsStifferThanTheDeviceHolds) {
    for (const double scale : {1.0, 4.0}) {
        auto owned = std::make_unique<Answering>();
        Answering& device = *owned;
        device.about.max_stiffness_n_per_m = 1000.0;
        device.z_m = 0.01 / scale;
        Loop loop{{.version = 5000},
                  {.stiffness_n_per_m = 600.0},
                  std::make_unique<WallAlgorithm>(),
                  std::move(owned),
                  {},
                  Workspace({0, 0, 0}, scale)};
        ServoTick t;
        for (int i = 0; i < 2200; ++i)
            t = loop.tick();
        EXPECT_EQ(t.faults, scale > 1.0 ? uint32_t{kFaultSoftened} : 0u);
        for (; device.z_m > 0.002 / scale; device.z_m -= 1e-5)
            t = loop.tick();
        EXPECT_NEAR(1e3 * t.touched.force_n.z / t.touched.depth_mm, std::min(600.0, 1000.0 / scale),
                    1e-6);
    }
    // Behind a known delay 20 N s/m hold no more than 20 / (0.5 ms + 2 ms).
    auto owned = std::make_unique<Answering>();
    owned->about.delay_s = 0.002;
    owned->z_m = 0.0045;
    Loop loop{{.version = 5000},
              {.stiffness_n_per_m = 20e3},
              std::make_unique<WallAlgorithm>(),
              std::move(owned)};
    EXPECT_NEAR(1e3 * loop.tick().touched.force_n.z / 0.5, 8e3, 1e-6);
}

TEST(Servo, ADeviceThatGoesAwayEndsForceAndSaysWhy) {
    std::vector<DeviceRecord> records(3000);
    for (size_t i = 0; i < records.size(); ++i) {
        records[i].sample.time_ns = static_cast<int64_t>(i) * kTick_ns;
        records[i].sample.position_m.z =
            i < 2500 ? 0.01 : 0.01 - 2e-6 * static_cast<double>(i - 2500) * 10;
        records[i].status = i < 2950 ? DeviceStatus::ok : DeviceStatus::gone;
    }
    Loop loop{{.version = 5000},
              {.stiffness_n_per_m = 500.0},
              std::make_unique<WallAlgorithm>(),
              std::make_unique<RecordedDevice>(
                  DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8}, records,
                  kTick_ns)};
    ServoTick t;
    for (int i = 0; i < 2950; ++i)
        t = loop.tick();
    EXPECT_GT(t.sent.force_n.z, 1.0);
    t = loop.tick();
    EXPECT_EQ(t.sent, Wrench{});
    EXPECT_EQ(t.faults, uint32_t{kFaultGone});
    EXPECT_FALSE(t.usable);
    EXPECT_EQ(loop.servo.safety().history().size(), 1000u);
}

} // namespace
} // namespace palpate::haptics
