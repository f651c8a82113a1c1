#include "haptics/servo/servo_thread.h"

#include <gtest/gtest.h>

#include <thread>

#include "engine/volume/edit.h"
#include "tests/unit/haptics_servo/bench_loop.h"

namespace palpate::haptics {
namespace {

HandPath slide() {
    return find_trajectory("slide")->make({.at_mm = {0, 0, 10}, .depth_mm = 1, .distance_mm = 3});
}

TEST(ServoThread, TicksOnTimeUntilToldToStopAndSaysWhatItGot) {
    Loop loop{ball_scene(),
              {.iso = 500.0},
              std::make_unique<WallAlgorithm>(),
              std::make_unique<RecordedDevice>(
                  DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8},
                  records_of_path(slide(), Workspace({0, 0, 0}, 1.0), kTick_ns), monotonic_ns())};
    std::atomic<int> ticks = 0;
    int64_t last_ns = 0;
    bool rises = true;
    {
        ServoThread thread(loop.servo, {.after = [&](const ServoTick& t) {
                               rises = rises && t.now_ns > last_ns;
                               last_ns = t.now_ns;
                               return ++ticks < 300;
                           }});
        EXPECT_FALSE(thread.state().policy.empty());
        // Anything that was asked for and not obtained is said.
        EXPECT_EQ(thread.state().real_time && thread.state().locked, thread.state().why.empty())
            << thread.state().why;
        while (!thread.ended())
            std::this_thread::yield();
#ifndef __SANITIZE_THREAD__ // whose shadow of memory has pages of its own
        // No tick found a page of its own missing: the data of the scene apart, which is one set.
        if (thread.state().locked) {
            EXPECT_LE(thread.use().page_faults, 64);
        }
#endif
    }
    EXPECT_EQ(ticks, 300);
    EXPECT_TRUE(rises);
    const Telemetry& t = loop.servo.telemetry();
    EXPECT_EQ(t.ticks.load(), 300u);
    EXPECT_EQ(t.wake_ns.count(), 300u);
    // A tick begins when it is due or later, so 300 ticks and those skipped last 0.3 s.
    EXPECT_GE(t.wake_ns.percentile(0.5), 0u);
    EXPECT_EQ(loop.poses.size(), 300u);
}

TEST(ServoThread, StopsWhenItsOwnerGoes) {
    Loop loop{ball_scene(),
              {.iso = 500.0},
              std::make_unique<WallAlgorithm>(),
              std::make_unique<RecordedDevice>(DeviceCapabilities{}, std::vector<DeviceRecord>(1))};
    { const ServoThread thread(loop.servo); }
    SUCCEED();
}

// Servo, editor, frame and a person at once; the thread sanitizer watches.
TEST(ServoThread, AnEditorAndAFrameRunBesideItWithoutARace) {
    const AlgorithmEntry& entry = algorithms().back();
    Loop loop{ball_scene(32),
              {.iso = 500.0},
              entry.make(),
              std::make_unique<RecordedDevice>(
                  DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8},
                  records_of_path(slide(), Workspace({0, 0, 0}, 1.0), kTick_ns), monotonic_ns())};
    auto frame = loop.scenes.add_reader();
    std::atomic<bool> done = false;
    uint64_t last_felt = 0;
    ServoThread servo(loop.servo, {.priority = 0, .after = [&](const ServoTick& t) {
                                       EXPECT_GE(t.scene_version, last_felt);
                                       last_felt = t.scene_version;
                                       return true;
                                   }});
    std::thread editor([&] {
        Volume now = *loop.scenes.latest().grey;
        for (uint32_t i = 0; !done; ++i) {
            VolumeEdit edit(now);
            for (uint32_t k = 0; k < 200; ++k)
                edit.set({(i + k) % 32, k % 32, (i / 7) % 32}, (i + k) % 1000);
            now = edit.commit();
            ToolStamp stamp;
            while (loop.poses.pop(stamp)) {
            }
            loop.scenes.publish(std::make_unique<const TouchScene>(
                TouchScene{.grey = now, .version = now.version()}));
        }
    });
    std::thread viewer([&] {
        double sum = 0.0;
        while (!done) {
            const auto pin = frame.pin();
            for (uint32_t i = 0; i < 32; ++i)
                sum += pin->grey->value({i, i, i});
        }
        EXPECT_TRUE(std::isfinite(sum));
    });
    while (loop.servo.telemetry().ticks < 500)
        std::this_thread::yield();
    done = true;
    editor.join();
    viewer.join();
    servo.stop();
    loop.scenes.collect();
    EXPECT_EQ(loop.scenes.waiting(), 0u);
}

} // namespace
} // namespace palpate::haptics
