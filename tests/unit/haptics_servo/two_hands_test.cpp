#include <gtest/gtest.h>

#include "engine/edit/stroke_run.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// Two hands on one volume: two devices, two proxies, two servos that read one mailbox.
namespace palpate::haptics {
namespace {

struct Hand {
    Workspace workspace{{0, 0, 0}, 1.0};
    std::unique_ptr<HapticDevice> device;
    std::unique_ptr<Algorithm> algorithm = find_algorithm("swept-point")->make();
    Ring<ToolStamp> poses{4096};
    Servo servo;

    Hand(const HandPath& path, Mailbox<TouchScene>& scenes, Mailbox<TouchParameters>& parameters)
        : device(Loop::simulated(path, "falcon")),
          servo({*device, *algorithm, scenes, parameters, &poses}, workspace, options()) {
        servo.arm();
    }
    static Servo::Options options() {
        Servo::Options options;
        options.limits.ramp_s = 0.1;
        return options;
    }
};

// From beside the ball of 10 mm to 2 mm into it along x.
HandPath press(double from_mm, double to_mm) {
    return HandPath({{.time_s = 0, .tool = {.position_mm = {from_mm, 0, 0}}},
                     {.time_s = 0.3, .tool = {.position_mm = {from_mm, 0, 0}}},
                     {.time_s = 0.6, .tool = {.position_mm = {to_mm, 0, 0}}}});
}

TEST(TwoHands, OneHoldsWhileTheOtherCarvesAndFeelsWhatIsTakenFromUnderIt) {
    std::vector<glm::dvec3> alone;
    for (const bool has_other : {false, true}) {
        const TouchScene scene = ball_scene();
        TouchParameters parameters;
        parameters.iso = 500.0;
        parameters.stiffness_n_per_m = 500.0;
        Mailbox<TouchScene> scenes(std::make_unique<const TouchScene>(scene));
        Mailbox<TouchParameters> felt(std::make_unique<const TouchParameters>(parameters));
        Hand holds(press(-15, -8), scenes, felt);
        Hand carves(press(15, 8), scenes, felt);
        const Tool burr{.shape = make_ball(3.0)};
        Operation cut;
        cut.kind = OperationKind::cut;
        cut.to_value = 0.0;
        auto stroke = StrokeRun::start(*scene.grey, burr, cut);
        ASSERT_TRUE(stroke) << stroke.error().message;
        double pushed_n = 0.0, carved_n = 0.0;
        for (int i = 1; i <= 1600; ++i) {
            const int64_t now_ns = i * kTick_ns;
            const ServoTick held = holds.servo.tick(now_ns, now_ns);
            ASSERT_EQ(held.faults & kFaultLatched, 0u);
            if (i < 1200) {
                if (!has_other)
                    alone.push_back(held.sent.force_n);
                else // the other hand and what it carves change no bit of it
                    ASSERT_EQ(held.sent.force_n, alone[static_cast<size_t>(i - 1)]) << i;
            }
            if (i == 1199)
                pushed_n = -held.sent.force_n.x;
            if (i >= 1500) { // gone from under it
                ASSERT_EQ(held.touched.contact, has_other ? Contact::free : Contact::touching) << i;
            }
            if (!has_other)
                continue;
            const ServoTick other = carves.servo.tick(now_ns, now_ns);
            if (i == 900)
                carved_n = other.sent.force_n.x;
            if (i < 950)
                continue;
            // First about the hand that carves, then under the one that holds.
            const glm::dvec3 at_mm = i < 1200 ? other.tool.position_mm : glm::dvec3(-8, 0, 0);
            const StrokePose pose{1e-3 * i, {at_mm, {1, 0, 0, 0}}};
            (*stroke)->add(std::span(&pose, 1));
            (*stroke)->work();
            const Volume now = (*stroke)->publish();
            scenes.publish(std::make_unique<const TouchScene>(
                TouchScene{.grey = now, .version = now.version()}));
        }
        // A hand of 300 N/m means to be 2 mm deep in 500 N/m; dry friction of 0.4 N holds it
        // between 0.25 and 1.25 mm.
        EXPECT_GT(pushed_n, 0.12);
        if (has_other) {
            EXPECT_GT(carved_n, 0.12); // each is pushed its own way
        }
    }
}

} // namespace
} // namespace palpate::haptics
