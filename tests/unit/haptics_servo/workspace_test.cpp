#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/unit/haptics_servo/bench_loop.h"

// A workspace that changes while a hand moves through it, pressed into a wall.
namespace palpate::haptics {
namespace {

// A hand that no force moves: where it is, and whether it holds button 1, over time.
struct Hand {
    std::function<glm::dvec3(double time_s)> place_mm;
    std::function<bool(double time_s)> presses = [](double) { return false; };
};

struct PressedHand {
    Mailbox<TouchScene> scenes{std::make_unique<const TouchScene>(TouchScene{.version = 5000})};
    Mailbox<TouchParameters> parameters{
        std::make_unique<const TouchParameters>(TouchParameters{.stiffness_n_per_m = 500.0})};
    Mailbox<WorkspaceSettings> settings{std::make_unique<const WorkspaceSettings>()};
    WallAlgorithm wall;
    RecordedDevice device;
    Servo servo;
    int64_t ticks = 0;

    static std::vector<DeviceRecord> records(const Hand& hand, int count) {
        std::vector<DeviceRecord> all(static_cast<size_t>(count));
        for (int i = 0; i < count; ++i) {
            const double t = 1e-3 * i;
            DeviceSample& sample = all[static_cast<size_t>(i)].sample;
            sample.time_ns = i * kTick_ns;
            sample.position_m = 1e-3 * hand.place_mm(t);
            sample.velocity_m_per_s =
                sample.position_m - 1e-3 * hand.place_mm(std::max(0.0, t - 1e-3));
            sample.velocity_m_per_s *= 1000.0;
            sample.buttons = hand.presses(t) ? 2 : 0;
        }
        return all;
    }
    explicit PressedHand(const Hand& hand, int count = 8000)
        : device({.workspace_m = glm::dvec3(0.1), .max_force_n = 8}, records(hand, count)),
          servo({device, wall, scenes, parameters, nullptr, &settings}, Workspace({0, 0, 0}, 1.0),
                {.clutch_button = 1}) {
        servo.arm();
    }
    ServoTick tick() {
        const int64_t now_ns = ticks++ * kTick_ns;
        return servo.tick(now_ns, now_ns);
    }
    ServoTick tick_until(double time_s) {
        ServoTick t;
        while (1e-3 * static_cast<double>(ticks) <= time_s)
            t = tick();
        return t;
    }
};

// Above the wall at z = 5 mm until 2.5 s, then pressed by 2 mm and moved to and fro by 3 mm.
glm::dvec3 rubs(double t) {
    const double down = std::clamp((t - 2.5) / 0.2, 0.0, 1.0);
    const double way = 3.0 * std::sin(2.0 * 3.14159265 * 1.5 * std::max(0.0, t - 2.7));
    return {way, 0.3 * way, 8.0 - 5.0 * down + 0.2 * way};
}

TEST(WorkspaceInUse, ScaleAndTurnChangeUnderAPressedHandWithoutAJump) {
    PressedHand run({.place_mm = rubs});
    ServoTick before = run.tick_until(3.5);
    EXPECT_GT(glm::length(before.sent.force_n), 0.5);
    const glm::dquat turn = aligned_with_view({0, 1, 0}, {-1, 0, 0}); // a quarter about the normal
    run.settings.publish(std::make_unique<const WorkspaceSettings>(WorkspaceSettings{2.5, turn}));
    double most_step_n = 0.0;
    glm::dvec3 hand_mm = rubs(3.5);
    for (double scale = 1.0; run.ticks < 6000;) {
        const glm::dvec3 now_mm = rubs(1e-3 * static_cast<double>(run.ticks));
        const ServoTick t = run.tick();
        scale = std::min(2.5, scale * 1.01);
        const double way_mm = glm::length(now_mm - hand_mm);
        hand_mm = now_mm;
        // The tool goes no farther than the hand at the scale of the moment.
        ASSERT_LE(glm::length(t.tool.position_mm - before.tool.position_mm), scale * way_mm + 1e-9);
        // Force: the spring over that way, and its turn by 3 mrad a tick; what passivity adds comes
        // with 0.02 N a tick, or as 0.2 k T of the speed (safety/passivity.h), and fades by 10 %.
        const double spring_n = 0.5 * scale * way_mm;
        const double step_n = glm::length(t.sent.force_n - before.sent.force_n);
        ASSERT_LE(step_n, spring_n + 0.003 * glm::length(t.sent.force_n) + 0.02 + 0.5 * spring_n +
                              0.1 * t.damping_n)
            << run.ticks;
        most_step_n = std::max(most_step_n, step_n);
        before = t;
    }
    EXPECT_GT(most_step_n, 0.0);
    EXPECT_EQ(before.faults, 0u);
}

// Pressed 2 mm deep; the clutch is held from 3.5 to 4.5 s while the hand moves away and stays
// there.
glm::dvec3 leaves(double t) {
    const double down = std::clamp((t - 2.5) / 0.2, 0.0, 1.0);
    const double away = std::clamp((t - 3.6) / 0.5, 0.0, 1.0);
    return {25.0 * away, 0.0, 8.0 - 5.0 * down + 10.0 * away};
}

void expect_no_jump(PressedHand& run) {
    const ServoTick pressed = run.tick_until(3.49);
    const double full_n = pressed.sent.force_n.z;
    EXPECT_NEAR(full_n, 1.0, 1e-6);
    ServoTick before = pressed;
    while (run.ticks < 5000) {
        const ServoTick t = run.tick();
        const double time_s = 1e-3 * static_cast<double>(run.ticks - 1);
        // Out within 20 ms, in within 100 ms; the tool stays all the time.
        const double most_n = full_n * 1e-3 / (time_s < 4.4 ? 0.020 : 0.100);
        ASSERT_LE(std::abs(t.sent.force_n.z - before.sent.force_n.z), most_n + 1e-9) << time_s;
        ASSERT_LE(glm::length(t.tool.position_mm - pressed.tool.position_mm), 1e-9) << time_s;
        if (time_s > 3.55 && time_s < 4.49) {
            ASSERT_EQ(t.sent.force_n, glm::dvec3(0)) << time_s;
        }
        before = t;
    }
    EXPECT_NEAR(before.sent.force_n.z, full_n, 1e-6);
}

TEST(WorkspaceInUse, AClutchThatIsReleasedInContactBringsForceBackGradually) {
    PressedHand by_button(
        {.place_mm = leaves, .presses = [](double t) { return t > 3.5 && t < 4.5; }});
    expect_no_jump(by_button);
}

TEST(WorkspaceInUse, AClutchByCommandIsAClutch) {
    PressedHand run({.place_mm = leaves});
    // Published between ticks, as another thread would.
    const auto set = [&](bool clutched) {
        run.settings.publish(
            std::make_unique<const WorkspaceSettings>(WorkspaceSettings{.clutched = clutched}));
    };
    const ServoTick pressed = run.tick_until(3.5);
    set(true);
    ServoTick t = run.tick_until(4.5);
    EXPECT_EQ(t.sent.force_n, glm::dvec3(0));
    EXPECT_EQ(t.tool.position_mm, pressed.tool.position_mm);
    set(false);
    double before_n = 0.0;
    while (run.ticks < 5000) {
        t = run.tick();
        ASSERT_LE(t.sent.force_n.z - before_n, 0.01 + 1e-9);
        before_n = t.sent.force_n.z;
    }
    EXPECT_NEAR(before_n, 1.0, 1e-6);
    EXPECT_LE(glm::length(t.tool.position_mm - pressed.tool.position_mm), 1e-9);
}

} // namespace
} // namespace palpate::haptics
