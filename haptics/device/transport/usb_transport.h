#pragma once

#include <memory>
#include <string>

#include "engine/base/fd.h"
#include "haptics/core/raw_halt.h"
#include "haptics/device/transport/transport.h"

struct usbdevfs_urb;

namespace palpate::haptics {

// A USB device by the kernel's own interface (usbfs), without a library: nothing locks or allocates
// in a tick, and a halt goes out by the same descriptor in the order of its endpoint
// (docs/decisions/15-usb-without-libraries.md).
class UsbTransport final : public Transport {
 public:
    // Claims an interface of the device at `node`. Refused, with a sentence that says why: no
    // permission, unplugged, or another program or driver holds the interface.
    static Result<std::unique_ptr<UsbTransport>> open(const std::string& node, unsigned interface);
    ~UsbTransport() override;

    void submit(Transfer& transfer) noexcept override;
    void cancel(Transfer& transfer) noexcept override;
    bool reap(int64_t until_ns) noexcept override;
    bool gone() const noexcept override { return gone_; }
    Clock& clock() noexcept override { return monotonic_clock(); }
    Result<void> prepare_halt(uint8_t endpoint, std::span<const std::byte> message) override;
    bool halt() noexcept override { return halt_.send(); }

 private:
    static constexpr size_t kSetup = 8; // bytes before those of a control transfer
    struct Flight {
        std::unique_ptr<usbdevfs_urb> urb;
        std::array<std::byte, kSetup + Transfer::kMost> bytes;
        int64_t due_ns = 0; // 0: never
        bool is_late = false;
    };

    UsbTransport(Fd fd, unsigned interface);
    bool take_one() noexcept;
    void lose_all() noexcept;
    bool any_pending() const noexcept;

    Fd fd_;
    unsigned interface_;
    bool gone_ = false;
    std::array<Flight, kTransfers> flights_{};
    RawHalt halt_;
};

} // namespace palpate::haptics
