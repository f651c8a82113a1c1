#pragma once

#include <cstdint>

// The clocks of touch, in nanoseconds. None of them allocates, throws or locks.
namespace palpate::haptics {

// CLOCK_MONOTONIC, which servo threads tick on. May be called from a signal's handler.
int64_t monotonic_ns() noexcept;
// Sleeps until monotonic_ns() is at least due_ns; returns at once where it is.
void sleep_until(int64_t due_ns) noexcept;
// Processor time of the calling thread.
int64_t thread_cpu_ns() noexcept;

// Time as those see it who wait for it: a real one, or that of a test.
class Clock {
 public:
    virtual ~Clock() = default;
    virtual int64_t now_ns() noexcept = 0;
    virtual void sleep_until(int64_t due_ns) noexcept = 0; // returns at once where it is past
};
Clock& monotonic_clock() noexcept; // of the functions above

} // namespace palpate::haptics
