#pragma once

#include <memory>
#include <string>

#include "engine/base/fd.h"
#include "haptics/core/raw_halt.h"
#include "haptics/device/transport/transport.h"

namespace palpate::haptics {

// A HID device by the kernel's hidraw, beside which the kernel's own drivers and other programs go
// on working. Transfers are reports. Outgoing ones, whose first byte is the report id, are written
// within submit(); of incoming ones at most one is in flight.
class HidTransport final : public Transport {
 public:
    static Result<std::unique_ptr<HidTransport>> open(const std::string& node);
    // Of a descriptor that gives and takes one report a call, such as a socket of packets.
    explicit HidTransport(Fd fd) : fd_(std::move(fd)) {}

    void submit(Transfer& transfer) noexcept override;
    void cancel(Transfer& transfer) noexcept override;
    bool reap(int64_t until_ns) noexcept override;
    bool gone() const noexcept override { return gone_; }
    Clock& clock() noexcept override { return monotonic_clock(); }
    Result<void> prepare_halt(uint8_t endpoint, std::span<const std::byte> message) override;
    bool halt() noexcept override { return halt_.send(); }

 private:
    bool look() noexcept;
    void lose() noexcept;

    Fd fd_;
    bool gone_ = false;
    Transfer* in_ = nullptr; // in flight
    int64_t due_ns_ = 0;     // of in_; 0: never
    bool is_cancelled_ = false;
    RawHalt halt_;
};

} // namespace palpate::haptics
