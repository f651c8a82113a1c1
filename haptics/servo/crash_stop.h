#pragma once

#include "haptics/core/device.h"

namespace palpate::haptics {

// While it lives, a device is halted where the process dies: on SIGSEGV, SIGBUS, SIGILL, SIGFPE and
// SIGABRT before whatever would have happened happens, and in exit(). What a driver had under way
// may still go out; what kills without a signal's handler (SIGKILL, power) is left to the device.
//
// Handlers are set with the first one and stay; at most 8 live at a time, more are refused by an
// assertion.
class CrashStop {
 public:
    explicit CrashStop(HapticDevice& device);
    ~CrashStop();
    CrashStop(const CrashStop&) = delete;
    CrashStop& operator=(const CrashStop&) = delete;

 private:
    size_t slot_;
};

} // namespace palpate::haptics
