#include "haptics/servo/crash_stop.h"

#include <poll.h>
#include <signal.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <mutex>

#include "engine/base/assert.h"
#include "haptics/core/clock.h"

namespace palpate::haptics {

namespace {

constexpr std::array kSignals{SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};

std::array<std::atomic<HapticDevice*>, 8> devices;
static_assert(std::atomic<HapticDevice*>::is_always_lock_free); // signal handlers read them
std::array<struct sigaction, kSignals.size()> before;

std::atomic<bool> is_dying{false};

bool halt_each() {
    bool any = false;
    for (std::atomic<HapticDevice*>& device : devices)
        if (HapticDevice* const now = device.load()) {
            now->halt(monotonic_ns());
            any = true;
        }
    return any;
}

// The servo may be between its look at dying() and the end of its write. All of this is for a
// signal's handler: poll() waits there, and sleeps by clock may not.
void halt_all() {
    is_dying.store(true);
    if (!halt_each())
        return;
    poll(nullptr, 0, 2);
    halt_each();
}

// Halts, puts back who handled the signal before, and lets it come again.
void on_signal(int number) {
    halt_all();
    for (size_t i = 0; i < kSignals.size(); ++i)
        if (kSignals[i] == number)
            sigaction(number, &before[i], nullptr);
    raise(number); // delivered when this handler returns
}

void set_handlers() {
    for (size_t i = 0; i < kSignals.size(); ++i) {
        struct sigaction action {};
        action.sa_handler = on_signal;
        action.sa_flags = SA_ONSTACK;
        sigemptyset(&action.sa_mask);
        sigaction(kSignals[i], &action, &before[i]);
    }
    std::atexit(halt_all);
}

} // namespace

bool CrashStop::dying() noexcept {
    return is_dying.load();
}

CrashStop::CrashStop(HapticDevice& device) {
    static std::once_flag once;
    std::call_once(once, set_handlers);
    for (slot_ = 0; slot_ < devices.size(); ++slot_) {
        HapticDevice* none = nullptr;
        if (devices[slot_].compare_exchange_strong(none, &device))
            return;
    }
    PALPATE_ASSERT_CMP(slot_, <, devices.size());
}

CrashStop::~CrashStop() {
    devices[slot_].store(nullptr);
}

} // namespace palpate::haptics
