#include "haptics/core/clock.h"

#include <time.h>

#include <cerrno>

namespace palpate::haptics {

namespace {

constexpr int64_t kNsPerS = 1'000'000'000;

int64_t read_clock(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return int64_t{now.tv_sec} * kNsPerS + now.tv_nsec;
}

class Monotonic final : public Clock {
 public:
    int64_t now_ns() noexcept override { return monotonic_ns(); }
    void sleep_until(int64_t due_ns) noexcept override { haptics::sleep_until(due_ns); }
};

} // namespace

int64_t monotonic_ns() noexcept {
    return read_clock(CLOCK_MONOTONIC);
}

void sleep_until(int64_t due_ns) noexcept {
    const timespec due{.tv_sec = due_ns / kNsPerS, .tv_nsec = due_ns % kNsPerS};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
    }
}

int64_t thread_cpu_ns() noexcept {
    return read_clock(CLOCK_THREAD_CPUTIME_ID);
}

Clock& monotonic_clock() noexcept {
    static Monotonic clock;
    return clock;
}

} // namespace palpate::haptics
