#pragma once

#include <pthread.h>

#include <atomic>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "haptics/servo/crash_stop.h"
#include "haptics/servo/servo.h"
#include "haptics/servo/watchdog.h"

namespace palpate::haptics {

struct ServoThreadOptions {
    int priority = 45;            // of SCHED_FIFO, below those of interrupt threads; 0: not asked
    int processor = -1;           // to stay on; -1: any
    size_t stack_bytes = 2 << 20; // its own, locked in memory
    // Memory besides the servo itself that ticks use: of the algorithm, of the ring.
    std::vector<std::span<const std::byte>> memory;
    // After each tick, on the servo's thread and under its rules; the thread ends where it says no.
    std::function<bool(const ServoTick&)> after;
    // Called by stop() where the tick at hand has not ended after kPatience_ns: a call of the
    // device's driver does not return, and what it uses cannot be freed. The watchdog has halted
    // the device. A program says so and ends; where this returns, stop() waits on.
    std::function<void()> hung;
};

// The real-time settings obtained, read back from the system.
struct ServoThreadState {
    std::string policy; // "SCHED_FIFO 45", "SCHED_OTHER"
    bool real_time = false;
    bool locked = false; // stack, servo and memory
    std::string why;     // one sentence for each thing that was refused; empty where none was
};

// Ticks a servo on a thread of its own, on the monotonic clock, at its rate or with its device's
// samples (pace.h).
//
// The policy is asked for and then read back; without permission
// (RLIMIT_RTPRIO, CAP_SYS_NICE) it goes on as an ordinary thread and says so. Locked in memory are
// its stack, the servo and what is named, not the whole address space. A watchdog of one priority
// more looks after it, and where the process dies its device is halted.
class ServoThread {
 public:
    ServoThread(Servo& servo, ServoThreadOptions options = {});
    ~ServoThread(); // stops it
    ServoThread(const ServoThread&) = delete;
    ServoThread& operator=(const ServoThread&) = delete;

    const ServoThreadState& state() const { return state_; }
    static constexpr int64_t kPatience_ns = 1'000'000'000;
    void stop(); // waits for the tick at hand; the last wrench sent is none
    bool ended() const { return ended_.load(std::memory_order_acquire); }
    // The use by its ticks alone; valid once it has ended.
    const ThreadUse& use() const { return use_; }

 private:
    static void* enter(void* self);
    void set_up();
    void run();
    void lock(std::span<const std::byte> memory, const char* what);

    Servo& servo_;
    ServoThreadOptions options_;
    ServoThreadState state_;
    std::span<std::byte> stack_;
    std::vector<std::span<const std::byte>> locked_;
    pthread_t thread_{};
    bool joined_ = false;
    std::atomic<bool> stopping_{false}, ready_{false}, ended_{false};
    ThreadUse use_;
    std::optional<CrashStop> crash_stop_;
    std::optional<Watchdog> watchdog_;
};

} // namespace palpate::haptics
