#pragma once

#include <atomic>
#include <cstdint>

#include "engine/base/json.h"
#include "haptics/safety/stages.h"
#include "haptics/servo/histogram.h"

namespace palpate::haptics {

// Statistics of the servo, always on. Times are nanoseconds. The servo's thread writes, any thread
// reads.
struct Telemetry {
    Histogram wake_ns;  // from when a tick was due to when it began
    Histogram cpu_ns;   // of the tick less the device, thread clock
    Histogram whole_ns; // from before the device was read to after it was written, wall clock
    Histogram versions_behind; // scenes published while the tick ran
    Histogram iterations;      // of the algorithm
    std::atomic<uint64_t> ticks{0};
    std::atomic<uint64_t> skipped{0};       // that were due while another ran or the machine slept
    std::atomic<uint64_t> poses_refused{0}; // by a full ring
    std::atomic<uint64_t> trips{0};         // of the watchdog
    // Of the newest tick.
    std::atomic<uint32_t> faults{0};
    std::atomic<DeviceStatus> status{DeviceStatus::ok};
    std::atomic<SoftStart::Mode> force{SoftStart::Mode::disarmed};
};

// {"ticks": .., "wake_us": {"p50", "p99", "p999", "p9999", "max"}, ...}
Json telemetry_json(const Telemetry& telemetry);

// Minor and major page faults, and switches that the calling thread did not ask for, since it
// began.
struct ThreadUse {
    int64_t page_faults = 0, involuntary_switches = 0;
};
ThreadUse thread_use() noexcept;

} // namespace palpate::haptics
