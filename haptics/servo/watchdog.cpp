#include "haptics/servo/watchdog.h"

#include <pthread.h>

#include <algorithm>

#include "haptics/core/clock.h"

namespace palpate::haptics {

namespace {

constexpr int64_t kMostSleep_ns = 20'000'000; // so that it ends soon when told to

} // namespace

Watchdog::Watchdog(Servo& servo, int priority)
    : thread_([this, &servo] {
          int64_t now_ns = monotonic_ns();
          while (!stopping_.load(std::memory_order_acquire)) {
              sleep_until(std::min(servo.watch(now_ns), now_ns + kMostSleep_ns));
              now_ns = monotonic_ns();
          }
      }) {
    if (priority > 0) { // refused as the servo's is, which says so
        const sched_param wanted{.sched_priority = priority};
        pthread_setschedparam(thread_.native_handle(), SCHED_FIFO, &wanted);
    }
}

Watchdog::~Watchdog() {
    stopping_.store(true, std::memory_order_release);
    thread_.join();
}

} // namespace palpate::haptics
