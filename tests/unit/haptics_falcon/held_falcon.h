#pragma once

#include "bench/touch/closed_loop.h"
#include "tests/unit/haptics_falcon/falcon_bench.h"

namespace palpate::haptics::falcon {

// The Falcon's driver on the model of one, held by the hand of a closed loop. A sample is as old as
// the bytes on the cable make it: what answered the write of the tick before.
class HeldFalcon final : public touch::HeldDevice {
 public:
    HeldFalcon(const HandPath& path, const HandModel& hand)
        : bench_({.path = path, .hand = hand}), device_(std::move(bench_.open().value())) {
        begin_ns_ = bench_.clock.now_ns();
    }
    // The host carries bytes meanwhile, as the servo's pace lets it: a host that slept until the
    // tick would send the force of the tick before only then, and samples would be a tick older.
    void wait(int64_t until_ns) override {
        device_->wait(begin_ns_ + until_ns);
        bench_.clock.sleep_until(begin_ns_ + until_ns);
        device_->wait(bench_.clock.now_ns());
    }
    HapticDevice& device() override { return *device_; }
    const SimulatedDevice& plant() const override { return bench_.model.plant(); }

 private:
    FalconBench bench_;
    std::unique_ptr<FalconDevice> device_;
    int64_t begin_ns_ = 0;
};

} // namespace palpate::haptics::falcon
