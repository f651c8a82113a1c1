#pragma once

#include "engine/base/json.h"

#include "engine/gpu/device.h"

namespace palpate::bench {

// The environment of figures: commit, compiler, processor, device and driver, and how busy the
// machine was.
Json environment(const DeviceInfo& device);

// How much of the machine other processes used since construction.
class Neighbours {
 public:
    Neighbours();
    double cores() const; // kept busy by others, on average

 private:
    double busy_s_, own_s_, wall_s_;
};

// Processor time of this process so far, in ms, over all threads.
double process_cpu_ms();

} // namespace palpate::bench
