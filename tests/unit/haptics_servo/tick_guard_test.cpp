#include "tests/support/tick_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/edit/editor.h"
#include "engine/volume/edit.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// A tick neither allocates, frees, locks nor touches a new page, with any algorithm.
namespace palpate::haptics {
namespace {

TEST(TickGuard, SeesWhatItIsThereToSee) {
    if (!TickGuard::works())
        GTEST_SKIP() << "the sanitizer has its own malloc";
    std::mutex mutex;
    TickGuard::begin();
    {
        const std::lock_guard lock(mutex);
        std::vector<char> v(1 << 22);
        for (size_t i = 0; i < v.size(); i += 4096)
            static_cast<volatile char*>(v.data())[i] = 1;
    }
    const TickGuard::Counts counts = TickGuard::end();
    EXPECT_EQ(counts.allocations, 1u);
    EXPECT_EQ(counts.frees, 1u);
    EXPECT_EQ(counts.locks, 1u);
    EXPECT_GE(counts.page_faults, 1u);
    TickGuard::begin();
    EXPECT_EQ(TickGuard::end().allocations, 0u);
}

TEST(TickGuard, NoTickAllocatesFreesLocksOrFaultsWithAnyAlgorithm) {
    if (!TickGuard::works())
        GTEST_SKIP() << "the sanitizer has its own malloc";
    const HandPath path = find_trajectory("reach")->make(
        {.at_mm = {0, 0, 10}, .depth_mm = 2, .distance_mm = 5, .duration_s = 5});
    for (const AlgorithmEntry& entry : algorithms()) {
        TouchParameters parameters;
        parameters.iso = 500.0;
        parameters.tool_radius_mm = 1.5;
        parameters.friction_static = parameters.friction_dynamic = 0.2;
        parameters.yield_n = 2.0;
        parameters.viscosity_n_s_per_m = 1.0;
        parameters.vibration_n = 0.2;
        Servo::Options options;
        options.limits.ramp_s = 0.1;
        Loop loop{ball_scene(), parameters, entry.make(), Loop::simulated(path, "touch"), options};
        TickGuard::Counts all;
        uint64_t felt = 0;
        for (int i = 0; i < 3000; ++i) {
            loop.removal.store(static_cast<float>(i % 500) / 500.0f);
            if (i % 100 == 50) { // an edit, between ticks as far as this thread is concerned
                VolumeEdit edit(*loop.scenes.latest().grey);
                edit.set({32, 32, 48u - static_cast<uint32_t>(i) / 1000}, 0);
                const Volume now = edit.commit();
                loop.scenes.publish(std::make_unique<const TouchScene>(
                    TouchScene{.grey = now, .version = now.version()}));
            }
            TickGuard::begin();
            const ServoTick t = loop.tick();
            const TickGuard::Counts counts = TickGuard::end();
            all.allocations += counts.allocations;
            all.frees += counts.frees;
            all.locks += counts.locks;
            // The first ticks bring in code, and state that nobody had touched; the thread of
            // servo_thread.h locks that in memory before.
            if (i >= 1000)
                all.page_faults += counts.page_faults;
            felt += t.touched.contact != Contact::free;
        }
        EXPECT_EQ(all.allocations, 0u) << entry.name;
        EXPECT_EQ(all.frees, 0u) << entry.name;
        EXPECT_EQ(all.locks, 0u) << entry.name;
        EXPECT_EQ(all.page_faults, 0u) << entry.name;
    }
}

// A stroke's inputs, the first of which may wake the editor's thread: what the servo's thread does
// for it takes no lock of this process and no memory.
TEST(TickGuard, NoInputAllocatesFreesOrLocksWhileTheEditorSleepsAndWakes) {
    if (!TickGuard::works())
        GTEST_SKIP() << "the sanitizer has its own malloc";
    const Volume block = *ball_scene().grey;
    for (const bool polls : {true, false}) {
        Editor editor(block);
        editor.poll_inputs(polls);
        auto states = editor.add_reader();
        TickGuard::Counts all;
        for (uint64_t number = 1; number <= 3000; ++number) {
            const auto kind = number % 30 == 1   ? EditInput::Kind::down
                              : number % 30 == 0 ? EditInput::Kind::up
                                                 : EditInput::Kind::move;
            TickGuard::begin();
            const bool pushed = editor.push({kind, {}, number, 0});
            const TickGuard::Counts counts = TickGuard::end();
            ASSERT_TRUE(pushed);
            all.allocations += counts.allocations;
            all.frees += counts.frees;
            all.locks += counts.locks;
            while (kind == EditInput::Kind::up && states.pin()->inputs_done < number)
                std::this_thread::yield(); // from here on it goes to sleep
        }
        EXPECT_EQ(all.allocations, 0u);
        EXPECT_EQ(all.frees, 0u);
        EXPECT_EQ(all.locks, 0u);
    }
}

// A servo's thread locks this in memory: the object that ticks, and one that it wraps.
TEST(TickGuard, EveryAlgorithmNamesItsMemory) {
    for (const AlgorithmEntry& entry : algorithms()) {
        const std::unique_ptr<Algorithm> algorithm = entry.make();
        const auto memory = algorithm->memory();
        const auto* self = reinterpret_cast<const std::byte*>(algorithm.get());
        EXPECT_TRUE(std::any_of(memory.begin(), memory.end(), [&](const auto& part) {
            return part.data() == self && part.size() > sizeof(Algorithm);
        })) << entry.name;
        EXPECT_EQ(memory.size(), entry.as_printed || entry.is_guide ? 2u : 1u) << entry.name;
    }
}

} // namespace
} // namespace palpate::haptics
