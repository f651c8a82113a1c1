#pragma once

#include <cstdint>

#include "haptics/core/clock.h"
#include "haptics/core/device.h"

namespace palpate::haptics {

// When a servo ticks next: by a timer, or with each sample of a device that sets the pace
// (DeviceCapabilities::paces).
//
// By a timer, ticks are due at absolute times a period apart, so that they do not drift; those that
// were missed are skipped and counted, never made up for.
//
// By the device, a tick is due a period after the one before and begins when the sample is there. A
// sample that is late by a period, or by kPatience_ns where that is less, is not waited for: the
// servo ticks without it, and then at least every kPatience_ns until samples come again, so that
// the safety chain can fade the force. Ticks never come closer than half a period, whatever the
// device says.
//
// For the thread that ticks; under its rules.
class Pace {
 public:
    static constexpr int64_t kPatience_ns = 1'000'000;

    Pace(HapticDevice& device, double rate_hz, Clock& clock) noexcept;

    struct Beat {
        int64_t now_ns = 0, due_ns = 0;
        int64_t skipped = 0; // ticks that were due since the one before
    };
    // Waits for the next tick.
    Beat next() noexcept;

 private:
    Beat next_by_device() noexcept;

    HapticDevice& device_;
    Clock& clock_;
    int64_t period_ns_;
    bool by_device_;
    int64_t last_ns_; // when the last tick began, or was due by the timer
    bool silent_ = false;
};

} // namespace palpate::haptics
