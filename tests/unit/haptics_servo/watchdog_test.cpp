#include "haptics/servo/watchdog.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <thread>

#include "haptics/servo/crash_stop.h"
#include "haptics/servo/servo_thread.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// A servo that hangs, wherever it hangs: force ends without it.
namespace palpate::haptics {
namespace {

using Hook = std::function<void()>;

// The wall, and something that happens while a tick is in the algorithm.
class HookedWall final : public Algorithm {
 public:
    Hook hook;
    void reset(const TickInput&) noexcept override {}
    TickOutput tick(const TickInput& input) noexcept override {
        const TickOutput out = wall_tick(state_, input);
        if (hook)
            hook();
        return out;
    }
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    WallState state_;
};

// Passes on to another device, with something that happens in read() and before write() reaches it.
class HookedDevice final : public HapticDevice {
 public:
    explicit HookedDevice(std::unique_ptr<HapticDevice> device) : device_(std::move(device)) {}
    Hook in_read, in_write;
    bool moves_by_ticks = false; // a hand that goes on with each read, however late it comes
    std::atomic<int> halts{0};
    std::atomic<int64_t> reads{0};
    std::atomic<bool> pushes{false}; // the last thing it was told is a force

    HapticDevice& inner() { return *device_; }
    const DeviceCapabilities& capabilities() const noexcept override {
        return device_->capabilities();
    }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override {
        if (in_read)
            in_read();
        const DeviceStatus status =
            device_->read(moves_by_ticks ? ++reads * kTick_ns : now_ns, sample);
        sample.time_ns = now_ns;
        return status;
    }
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override {
        if (in_write)
            in_write();
        pushes = wrench != Wrench{};
        return device_->write(now_ns, wrench);
    }
    void halt(int64_t now_ns) noexcept override {
        pushes = false;
        ++halts;
        device_->halt(now_ns);
    }

 private:
    std::unique_ptr<HapticDevice> device_;
};

// In the wall at z = 5 mm, with force, on the virtual clock.
struct PressedWatchdog {
    HookedWall* wall;
    HookedDevice* device;
    Loop loop;
    Servo& servo = loop.servo;

    static HandPath path() {
        return HandPath({{.time_s = 0, .tool = {.position_mm = {0, 0, 10}}},
                         {.time_s = 2.2, .tool = {.position_mm = {0, 0, 10}}},
                         {.time_s = 2.4, .tool = {.position_mm = {0, 0, 1}}}});
    }
    explicit PressedWatchdog(const char* preset = "ideal")
        : PressedWatchdog(std::make_unique<HookedWall>(),
                          std::make_unique<HookedDevice>(Loop::simulated(path(), preset))) {}
    PressedWatchdog(std::unique_ptr<HookedWall> a, std::unique_ptr<HookedDevice> d)
        : wall(a.get()),
          device(d.get()),
          loop{{.version = 5000}, {.stiffness_n_per_m = 500.0}, std::move(a), std::move(d)} {
        for (int i = 0; i < 3000; ++i)
            last = loop.tick();
        EXPECT_GT(last.sent.force_n.z, 0.5);
    }
    const SimulatedDevice& simulated() {
        return static_cast<const SimulatedDevice&>(device->inner());
    }
    // Looks every 0.1 ms for so long without a tick.
    void hang(int64_t ms) {
        const int64_t from_ns = loop.now_ns;
        for (int64_t at = 0; at <= 10 * ms; ++at)
            servo.watch(from_ns + at * 100'000);
    }
    ServoTick last;
};

// The tick after a hang of `ms`, on schedule as the thread makes it.
void expect_starts_anew(PressedWatchdog& run, int64_t ms) {
    run.loop.now_ns += ms * kTick_ns;
    for (int i = 0; i < 500; ++i) { // in contact still: the soft start waits
        const ServoTick t = run.loop.tick();
        ASSERT_EQ(t.sent, Wrench{}) << i;
        ASSERT_EQ(t.share, 0.0) << i;
        if (i == 0) {
            EXPECT_EQ(t.faults, uint32_t{kFaultTooLate});
        }
        run.servo.watch(run.loop.now_ns);
    }
    EXPECT_FALSE(run.device->pushes);
    EXPECT_EQ(run.servo.telemetry().trips.load(), 1u);
}

TEST(Watchdog, LeavesAServoOnTimeAlone) {
    PressedWatchdog run;
    for (int i = 0; i < 1000; ++i) {
        run.loop.tick();
        for (int64_t later : {0, 5, 11}) // ms after the write
            ASSERT_GT(run.servo.watch(run.loop.now_ns + later * kTick_ns), run.loop.now_ns);
    }
    EXPECT_EQ(run.device->halts, 0);
    EXPECT_EQ(run.servo.telemetry().trips.load(), 0u);
}

TEST(Watchdog, AServoThatTicksNoMoreLosesItsForceInElevenMilliseconds) {
    PressedWatchdog run;
    const int64_t wrote_ns = run.loop.now_ns;
    int64_t now_ns = wrote_ns;
    while (run.device->halts == 0 && now_ns < wrote_ns + 50 * kTick_ns)
        now_ns = run.servo.watch(now_ns); // sleeping as it says
    EXPECT_GE(now_ns, wrote_ns);
    EXPECT_EQ(run.device->halts, 1);
    DeviceSample sample;
    // The force stood until then, and not a step of the simulation longer.
    run.device->inner().read(wrote_ns + 11 * kTick_ns, sample);
    EXPECT_GT(run.simulated().acting_force_n().z, 0.5);
    run.device->inner().read(wrote_ns + 11 * kTick_ns + 2 * SimulatedDevice::kStep_ns, sample);
    EXPECT_EQ(run.simulated().acting_force_n(), glm::dvec3(0));
    expect_starts_anew(run, 20);
}

TEST(Watchdog, WhatIsOnItsWayInADelayedDeviceIsLostToo) {
    DevicePreset preset = *find_device_preset("ideal");
    preset.plant.delay_ticks = 2;
    SimulatedDevice device(preset, {}, PressedWatchdog::path(), Workspace({0, 0, 0}, 1.0));
    for (int64_t i = 1; i <= 3; ++i)
        device.write(i * kTick_ns, {{3, 0, 0}, {}});
    EXPECT_EQ(device.acting_force_n().x, 3.0);
    device.halt(3 * kTick_ns);
    for (int64_t i = 4; i < 8; ++i) {
        device.write(i * kTick_ns, {});
        EXPECT_EQ(device.acting_force_n(), glm::dvec3(0)) << i;
    }
}

// The thread that hangs is in the middle of a tick; what it brings back is old.
TEST(Watchdog, ForceOfATickThatHungNeverGoesOut) {
    enum class Where { algorithm, read, write };
    for (const Where where : {Where::algorithm, Where::read, Where::write}) {
        SCOPED_TRACE(static_cast<int>(where));
        PressedWatchdog run;
        bool once = false;
        const auto hang = [&] {
            if (std::exchange(once, true))
                return;
            run.hang(20);
            EXPECT_GE(run.device->halts, 9); // at 12 ms, and every look after
            EXPECT_FALSE(run.device->pushes);
        };
        (where == Where::algorithm ? run.wall->hook
         : where == Where::read    ? run.device->in_read
                                   : run.device->in_write) = hang;
        const ServoTick hung = run.loop.tick();
        EXPECT_TRUE(once);
        EXPECT_EQ(hung.sent, Wrench{});
        EXPECT_EQ(hung.sent_world_n, glm::dvec3(0));
        EXPECT_FALSE(run.device->pushes);
        expect_starts_anew(run, 20);
    }
}

TEST(Watchdog, ItsThreadEndsForceWhileTheServosThreadHangs) {
    auto wall = std::make_unique<HookedWall>();
    std::atomic<bool> hang = false, hangs = false;
    wall->hook = [&] {
        while (hang) {
            hangs = true;
            std::this_thread::yield();
        }
    };
    auto device = std::make_unique<HookedDevice>(std::make_unique<RecordedDevice>(
        DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8},
        records_of_path(HandPath({{.time_s = 0, .tool = {.position_mm = {0, 0, 5.1}}},
                                  {.time_s = 1.0, .tool = {.position_mm = {0, 0, 5.1}}},
                                  {.time_s = 1.1, .tool = {.position_mm = {0, 0, 2}}},
                                  {.time_s = 60, .tool = {.position_mm = {0, 0, 2}}}}),
                        Workspace({0, 0, 0}, 1.0), kTick_ns),
        kTick_ns));
    HookedDevice& seen = *device;
    seen.moves_by_ticks = true;
    Servo::Options options;
    options.limits.ramp_s = 0.02;
    options.limits.late_ns = options.limits.too_late_ns = 1'000'000'000; // of the busy machine
    Loop loop{{.version = 5000},
              {.stiffness_n_per_m = 500.0},
              std::move(wall),
              std::move(device),
              options};
    ServoThread thread(loop.servo, {.priority = 0});
    // Deep in the wall; without end where it never pushes: ctest then ends the test.
    while (seen.reads < 1200 || !seen.pushes)
        std::this_thread::yield();
    hang = true;
    while (!hangs)
        std::this_thread::yield();
    while (seen.halts < 3) // once, and again
        std::this_thread::yield();
    EXPECT_FALSE(seen.pushes);
    hang = false;
    const uint64_t ticks = loop.servo.telemetry().ticks;
    while (loop.servo.telemetry().ticks < ticks + 20)
        std::this_thread::yield();
    EXPECT_FALSE(seen.pushes); // in contact, it waits
    EXPECT_EQ(loop.servo.telemetry().trips.load(), 1u);
}

// Says on stderr that it was halted, with what a signal's handler may call.
class LoudDevice final : public HapticDevice {
 public:
    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    DeviceStatus read(int64_t, DeviceSample&) noexcept override { return DeviceStatus::stale; }
    DeviceStatus write(int64_t, const Wrench&) noexcept override { return DeviceStatus::ok; }
    void halt(int64_t) noexcept override { [[maybe_unused]] auto _ = ::write(2, "halted\n", 7); }

 private:
    DeviceCapabilities capabilities_;
};

TEST(CrashStopDeathTest, ADeviceIsHaltedWhereTheProcessDies) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_EXIT(
        {
            LoudDevice device;
            const CrashStop stop(device);
            std::abort();
        },
        testing::KilledBySignal(SIGABRT), "halted");
    EXPECT_EXIT(
        {
            static LoudDevice device;
            static const CrashStop* const stop = new CrashStop(device);
            std::exit(stop != nullptr ? 3 : 4);
        },
        testing::ExitedWithCode(3), "halted");
    EXPECT_EXIT(
        {
            LoudDevice device;
            { const CrashStop stop(device); }
            std::exit(3); // nothing is left to halt
        },
        testing::ExitedWithCode(3), "^$");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    EXPECT_EXIT(
        {
            LoudDevice device;
            const CrashStop stop(device);
            *static_cast<volatile int*>(nullptr) = 1;
        },
        testing::KilledBySignal(SIGSEGV), "halted");
#endif
}

// A driver that never returns: stop() tells its owner, who may end the program.
TEST(ServoThread, SaysThatADriverDoesNotReturn) {
    auto owned = std::make_unique<HookedDevice>(std::make_unique<RecordedDevice>(
        DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8},
        std::vector<DeviceRecord>(1)));
    HookedDevice& device = *owned;
    std::atomic<int> writes{0};
    std::atomic<bool> was_told{false};
    Loop loop{{.version = 5000},
              {.stiffness_n_per_m = 500.0},
              std::make_unique<HookedWall>(),
              std::move(owned)};
    device.in_write = [&] { // the watchdog acts once a first write has ended
        while (++writes > 1 && !was_told)
            std::this_thread::yield();
    };
    ServoThread thread(loop.servo, {.priority = 0, .hung = [&] {
                                        EXPECT_GT(device.halts.load(), 0);
                                        was_told = true;
                                    }});
    while (writes < 2)
        std::this_thread::yield();
    const int64_t from_ns = monotonic_ns();
    thread.stop();
    EXPECT_TRUE(was_told);
    EXPECT_GE(monotonic_ns() - from_ns, ServoThread::kPatience_ns);
    EXPECT_TRUE(thread.ended());
}

} // namespace
} // namespace palpate::haptics
