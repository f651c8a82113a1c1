#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <vector>

#include "haptics/device/transport/transport.h"

// A transport without hardware: a device model and a host. On a virtual clock the result is the
// same each time. Faults come from a function that sees every transfer before it ends.
namespace palpate::haptics {

class VirtualClock final : public Clock {
 public:
    explicit VirtualClock(int64_t at_ns = 0) : at_ns_(at_ns) {}
    int64_t now_ns() noexcept override { return at_ns_; }
    void sleep_until(int64_t due_ns) noexcept override { at_ns_ = std::max(at_ns_, due_ns); }

 private:
    int64_t at_ns_;
};

// The device's end of the cable. Times rise from call to call.
class FakePeer {
 public:
    virtual ~FakePeer() = default;
    virtual void advance(int64_t to_ns) = 0; // its own time passes
    // A control request. False: it refuses (stall).
    virtual bool control(const UsbSetup& setup, std::span<const std::byte> bytes) = 0;
    // Bytes to an endpoint. False: no room now; the host asks again.
    virtual bool out(uint8_t endpoint, std::span<const std::byte> bytes) = 0;
    // The next packet of an endpoint into `room`: its size, or -1 where there is none yet.
    virtual int in(uint8_t endpoint, std::span<std::byte> room) = 0;
    virtual void plugged() = 0; // power comes back after it was unplugged
};

class FakeTransport final : public Transport {
 public:
    static constexpr int64_t kPoll_ns = 50'000; // how often the host asks the device

    // A fault may change a transfer that is about to end, its status and bytes included. Outgoing
    // ones are seen before the device gets them, and reach it only if they stay `done`. A transfer
    // that is left `pending` does not end in this round.
    using Fault = std::function<void(Transfer&, int64_t now_ns)>;

    // Both outlive it.
    FakeTransport(FakePeer& peer, Clock& clock) : peer_(peer), clock_(clock) {}

    void set_fault(Fault fault) { fault_ = std::move(fault); }
    // Pending transfers end with the next reap().
    void unplug() noexcept { gone_ = true; }

    void submit(Transfer& transfer) noexcept override;
    void cancel(Transfer& transfer) noexcept override;
    bool reap(int64_t until_ns) noexcept override;
    Clock& clock() noexcept override { return clock_; }
    Result<void> prepare_halt(uint8_t endpoint, std::span<const std::byte> message) override;
    bool halt() noexcept override;

 private:
    bool round();
    bool end_one(Transfer& transfer);

    FakePeer& peer_;
    Clock& clock_;
    Fault fault_;
    std::array<bool, kTransfers> is_cancelled_{};
    std::array<size_t, kTransfers> order_{}; // slots in order of submission
    size_t ordered_ = 0;
    uint8_t halt_endpoint_ = 0;
    std::vector<std::byte> halt_message_;
    std::atomic<uint32_t> halts_{0}; // not sent yet
};

} // namespace palpate::haptics
