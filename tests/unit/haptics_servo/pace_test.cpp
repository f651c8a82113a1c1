#include "haptics/servo/pace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "haptics/servo/servo_thread.h"
#include "tests/unit/haptics_servo/bench_loop.h"

// Ticks by a timer and with the samples of a device, on a virtual clock.
namespace palpate::haptics {
namespace {

class VirtualClock final : public Clock {
 public:
    int64_t at_ns = 0;
    int64_t now_ns() noexcept override { return at_ns; }
    void sleep_until(int64_t due_ns) noexcept override { at_ns = std::max(at_ns, due_ns); }
};

// A hand whose samples come at given times, and sets the pace with them.
class ScriptedDevice final : public HapticDevice {
 public:
    ScriptedDevice(VirtualClock& clock, std::vector<int64_t> times_ns, double rate_hz, bool paces)
        : clock_(clock),
          times_ns_(std::move(times_ns)),
          capabilities_{.workspace_m = glm::dvec3(0.05),
                        .max_force_n = 8,
                        .rate_hz = rate_hz,
                        .paces = paces} {}

    double (*height_m)(int64_t now_ns) = nullptr; // of the hand; null: above the wall
    int64_t gone_ns = std::numeric_limits<int64_t>::max();
    bool floods = false; // says that there is a sample, always
    int waits = 0;

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    bool wait(int64_t until_ns) noexcept override {
        ++waits;
        if (floods)
            return true;
        if (next_ == times_ns_.size() || times_ns_[next_] > std::min(until_ns, gone_ns)) {
            clock_.sleep_until(std::min(until_ns, gone_ns));
            return false;
        }
        clock_.sleep_until(times_ns_[next_]);
        return true;
    }
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override {
        if (now_ns >= gone_ns)
            return DeviceStatus::gone;
        const size_t before = next_;
        while (next_ < times_ns_.size() && times_ns_[next_] <= now_ns)
            ++next_;
        if (next_ == before)
            return DeviceStatus::stale;
        sample = {.time_ns = now_ns,
                  .position_m = {0, 0, height_m ? height_m(times_ns_[next_ - 1]) : 0.01}};
        return DeviceStatus::ok;
    }
    DeviceStatus write(int64_t, const Wrench& wrench) noexcept override {
        sent = wrench;
        return DeviceStatus::ok;
    }
    void halt(int64_t) noexcept override { sent = {}; }
    Wrench sent;

 private:
    VirtualClock& clock_;
    std::vector<int64_t> times_ns_;
    DeviceCapabilities capabilities_;
    size_t next_ = 0;
};

// 10 mm above z = 0, and from 2.5 s on 3 mm: 2 mm in the wall at 5 mm, 1 N at 500 N/m.
double into_the_wall(int64_t now_ns) {
    const double way = std::clamp((static_cast<double>(now_ns) * 1e-9 - 2.5) / 0.1, 0.0, 1.0);
    return 0.01 - 0.007 * way;
}

std::vector<int64_t> every(int64_t period_ns, int64_t until_ns, int64_t jitter_ns = 0) {
    std::vector<int64_t> times;
    uint64_t random = 1;
    for (int64_t t = period_ns; t < until_ns; t += period_ns) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        times.push_back(t + (jitter_ns ? static_cast<int64_t>(random >> 40) % jitter_ns : 0));
    }
    return times;
}

// A servo above and in the wall, in the pace of such a device.
struct Paced {
    VirtualClock clock;
    ScriptedDevice* device;
    Loop loop;
    Pace pace;
    Pace::Beat beat;

    explicit Paced(std::vector<int64_t> times_ns, double rate_hz = 1000.0, bool paces = true)
        : Paced(std::make_unique<ScriptedDevice>(clock, std::move(times_ns), rate_hz, paces),
                rate_hz) {}
    Paced(std::unique_ptr<ScriptedDevice> d, double rate_hz)
        : device(d.get()),
          loop{{.version = 5000},
               {.stiffness_n_per_m = 500.0},
               std::make_unique<WallAlgorithm>(),
               std::move(d),
               {.rate_hz = rate_hz}},
          pace(*device, rate_hz, clock) {
        device->height_m = into_the_wall;
    }
    ServoTick tick() {
        beat = pace.next();
        return loop.servo.tick(beat.now_ns, beat.due_ns);
    }
    ServoTick tick_until(int64_t now_ns) {
        ServoTick t;
        do
            t = tick();
        while (t.now_ns < now_ns);
        return t;
    }
};

TEST(Pace, ATimerKeepsItsTimesAndSkipsWhatItMissed) {
    VirtualClock clock;
    RecordedDevice device({}, std::vector<DeviceRecord>(1));
    Pace pace(device, 1000.0, clock);
    for (int64_t i = 1; i <= 5; ++i) {
        const Pace::Beat beat = pace.next();
        EXPECT_EQ(beat.due_ns, i * kTick_ns);
        EXPECT_EQ(beat.now_ns, i * kTick_ns);
        EXPECT_EQ(beat.skipped, 0);
        clock.at_ns += 300'000; // of the tick's own: no drift
    }
    clock.at_ns = 9 * kTick_ns + 100'000; // four were due, the last of them is made now
    const Pace::Beat beat = pace.next();
    EXPECT_EQ(beat.skipped, 3);
    EXPECT_EQ(beat.due_ns, 9 * kTick_ns);
    EXPECT_EQ(beat.now_ns, 9 * kTick_ns + 100'000);
}

TEST(Pace, TicksBeginWithTheSamplesWhateverTheirJitter) {
    const std::vector<int64_t> times = every(kTick_ns, 4'000 * kTick_ns, 400'000);
    Paced run(times);
    for (const int64_t time_ns : times) {
        const ServoTick t = run.tick();
        ASSERT_EQ(t.now_ns, time_ns);
        ASSERT_EQ(t.status, DeviceStatus::ok);
        ASSERT_EQ(t.faults, 0u);
    }
    EXPECT_NEAR(run.device->sent.force_n.z, 1.0, 1e-9);
}

TEST(Pace, SamplesOnTimeGiveTheForcesOfATimerToTheBit) {
    const std::vector<int64_t> times = every(kTick_ns, 4'000 * kTick_ns);
    Paced by_device(times), by_timer(times, 1000.0, false);
    for (size_t i = 0; i < times.size(); ++i) {
        const ServoTick a = by_device.tick(), b = by_timer.tick();
        ASSERT_EQ(a.now_ns, b.now_ns);
        ASSERT_EQ(a.sent, b.sent);
    }
    EXPECT_GT(by_device.device->waits, 3'000);
    EXPECT_EQ(by_timer.device->waits, 0);
}

// In contact the samples stop. Force is held for 3 ms after the next one was due, then fades evenly
// to nothing at 10 ms, and nothing is latched.
TEST(Pace, WhereSamplesStopForceFadesAndComesBackWithASoftStart) {
    for (const int64_t period_ns : {kTick_ns / 4, kTick_ns, 4 * kTick_ns, 10 * kTick_ns}) {
        SCOPED_TRACE(period_ns);
        std::vector<int64_t> times = every(period_ns, 6'000 * kTick_ns);
        const int64_t last_ns = 3'000 * kTick_ns, back_ns = 4'000 * kTick_ns;
        std::erase_if(times, [&](int64_t t) { return t > last_ns && t < back_ns; });
        Paced run(times, 1e9 / static_cast<double>(period_ns));
        double before_n = run.tick_until(last_ns).sent.force_n.z;
        EXPECT_NEAR(before_n, 1.0, 1e-9);
        int64_t zero_ns = 0, before_ns = last_ns;
        for (ServoTick t = run.tick(); t.now_ns < back_ns; t = run.tick()) {
            ASSERT_NE(t.status, DeviceStatus::ok);
            const double n = t.sent.force_n.z;
            const int64_t silence_ns = t.now_ns - last_ns - period_ns;
            if (silence_ns <= 3 * kTick_ns) {
                ASSERT_EQ(n, before_n);
            }
            // Evenly: 1 N in 7 ms, a tick at least every millisecond.
            ASSERT_LE(n, before_n);
            ASSERT_GE(n, before_n - static_cast<double>(kTick_ns) / (7.0 * kTick_ns) - 1e-9);
            ASSERT_LE(t.now_ns - before_ns, std::max(period_ns, int64_t{0}) + kTick_ns);
            if (n == 0.0 && zero_ns == 0)
                zero_ns = silence_ns;
            before_n = n;
            before_ns = t.now_ns;
        }
        EXPECT_GT(zero_ns, 9 * kTick_ns);
        EXPECT_LE(zero_ns, 11 * kTick_ns);
        EXPECT_FALSE(run.loop.servo.safety().latched());
        // Back, in contact: nothing before the hand has left and the soft start has begun.
        const ServoTick t = run.tick_until(5'500 * kTick_ns);
        EXPECT_EQ(t.status, DeviceStatus::ok);
        EXPECT_EQ(t.sent, Wrench{});
    }
}

TEST(Pace, ASampleThatIsLeftOutIsNotFelt) {
    std::vector<int64_t> times = every(kTick_ns, 3'500 * kTick_ns);
    std::erase_if(times, [](int64_t t) { return t / kTick_ns % 100 == 37; });
    Paced run(times);
    run.tick_until(2'700 * kTick_ns);
    int64_t left_out = 0;
    for (ServoTick t = run.tick(); t.now_ns < 3'400 * kTick_ns; t = run.tick()) {
        ASSERT_EQ(t.status, DeviceStatus::ok);
        ASSERT_NEAR(t.sent.force_n.z, 1.0, 1e-9);
        ASSERT_EQ(t.faults, 0u);
        left_out += run.beat.skipped;
    }
    EXPECT_EQ(left_out, 7);
}

TEST(Pace, ADeviceThatIsGoneEndsForceAtOnceAndIsLatched) {
    Paced run(every(kTick_ns, 4'000 * kTick_ns));
    run.device->gone_ns = 3'000 * kTick_ns + 1;
    run.tick_until(3'000 * kTick_ns);
    EXPECT_GT(run.device->sent.force_n.z, 0.9);
    const ServoTick t = run.tick();
    EXPECT_EQ(t.sent, Wrench{});
    EXPECT_EQ(t.faults, uint32_t{kFaultGone});
}

TEST(Pace, ADeviceThatIsAlwaysReadyDoesNotMakeTheServoSpin) {
    Paced run(std::vector<int64_t>{});
    run.device->floods = true;
    int ticks = 0;
    while (run.clock.at_ns < 100 * kTick_ns) {
        run.tick();
        ++ticks;
    }
    EXPECT_LE(ticks, 200);
}

// A device on the real clock, which falls silent: its thread goes on, and ends when told to.
TEST(Pace, AThreadEndsAlthoughItsDeviceIsSilent) {
    class Real final : public HapticDevice {
     public:
        std::atomic<bool> silent{false};
        const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
        bool wait(int64_t until_ns) noexcept override {
            const int64_t next_ns = last_ns_ + 2 * kTick_ns;
            if (silent || next_ns > until_ns) {
                sleep_until(until_ns);
                return false;
            }
            sleep_until(next_ns);
            return true;
        }
        DeviceStatus read(int64_t now_ns, DeviceSample&) noexcept override {
            if (silent || now_ns < last_ns_ + 2 * kTick_ns)
                return DeviceStatus::stale;
            last_ns_ = now_ns;
            return DeviceStatus::ok;
        }
        DeviceStatus write(int64_t, const Wrench&) noexcept override { return DeviceStatus::ok; }
        void halt(int64_t) noexcept override {}

     private:
        DeviceCapabilities capabilities_{
            .workspace_m = glm::dvec3(0.05), .max_force_n = 8, .rate_hz = 500.0, .paces = true};
        int64_t last_ns_ = monotonic_ns();
    };
    auto device = std::make_unique<Real>();
    Real& real = *device;
    Loop loop{{.version = 5000},
              {.stiffness_n_per_m = 500.0},
              std::make_unique<WallAlgorithm>(),
              std::move(device),
              {.rate_hz = 500.0}};
    ServoThread thread(loop.servo, {.priority = 0});
    const Telemetry& seen = loop.servo.telemetry();
    while (seen.ticks < 50)
        std::this_thread::yield();
    real.silent = true;
    const uint64_t then = seen.ticks;
    while (seen.ticks < then + 50)
        std::this_thread::yield();
    thread.stop();
    EXPECT_TRUE(thread.ended());
}

} // namespace
} // namespace palpate::haptics
