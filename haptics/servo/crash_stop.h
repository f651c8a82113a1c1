#pragma once

#include "haptics/core/device.h"

namespace palpate::haptics {

// While it lives, a device is halted where the process dies: on SIGSEGV, SIGBUS, SIGILL, SIGFPE and
// SIGABRT before whatever would have happened happens, and in exit(). From then on servos begin no
// write, and what a driver had under way is taken back by a second halt 2 ms later. What kills
// without a signal's handler (SIGKILL, power) is left to the device's own watchdog
// (DeviceCapabilities::watchdog_ns).
//
// Handlers are set with the first one and stay; at most 8 live at a time, more are refused by an
// assertion.
class CrashStop {
 public:
    explicit CrashStop(HapticDevice& device);
    ~CrashStop();
    CrashStop(const CrashStop&) = delete;
    CrashStop& operator=(const CrashStop&) = delete;

    // The process dies: nothing may be written any more. From any thread.
    static bool dying() noexcept;

 private:
    size_t slot_;
};

} // namespace palpate::haptics
