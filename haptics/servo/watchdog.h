#pragma once

#include <atomic>
#include <thread>

#include "haptics/servo/servo.h"

namespace palpate::haptics {

// Looks after a servo from a thread of its own, so that force ends although the servo hangs.
//
// It sleeps until the newest write would be too old, looks once (Servo::watch), and sleeps again: a
// servo on time wakes it about every 11 ms. With a servo that hangs the device is halted then, and
// once a millisecond until the servo is back. `priority` of SCHED_FIFO is asked for where it is not
// 0, above the servo's: one that spins must not hold it off.
class Watchdog {
 public:
    Watchdog(Servo& servo, int priority);
    ~Watchdog(); // waits for its look at hand
    Watchdog(const Watchdog&) = delete;
    Watchdog& operator=(const Watchdog&) = delete;

 private:
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

} // namespace palpate::haptics
