#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "engine/base/error.h"
#include "haptics/core/clock.h"

// How bytes get to a device and back. Drivers stand on this interface; behind it is libusb (usb.h),
// hidapi (hid.h), or the fake of fake_transport.h, all of which carry the same bytes.
namespace palpate::haptics {

enum class TransferStatus : uint8_t {
    idle,       // never submitted
    pending,    // submitted; its bytes belong to the transport
    done,       // `moved` bytes went or came
    timed_out,  // not done within timeout_ns
    stalled,    // the endpoint refuses
    overflowed, // the device sent more than there is room for
    cancelled,
    gone,   // the device is unplugged
    failed, // the system refused it, or a bus error
};

enum class TransferKind : uint8_t {
    control,    // `setup` goes to endpoint 0, `bytes` follow it
    bulk,       // a packet or more to or from an endpoint
    interrupt,  // the same of an interrupt endpoint
    hid_report, // one report of a HID device; its first byte is the report id, 0 where it has none
};

// The first 8 bytes of a control transfer without its length (USB 2.0, 9.3).
struct UsbSetup {
    uint8_t type = 0, request = 0;
    uint16_t value = 0, index = 0;

    friend bool operator==(const UsbSetup&, const UsbSetup&) = default;
};

struct Transfer {
    static constexpr size_t kMost = 512; // bytes

    TransferKind kind = TransferKind::bulk;
    uint8_t endpoint = 0;   // bit 7: towards the computer
    UsbSetup setup;         // of control transfers
    int64_t timeout_ns = 0; // 0: none
    size_t size = 0;        // bytes to send, or room for those that come
    size_t moved = 0;       // of a transfer that is done
    TransferStatus status = TransferStatus::idle;
    std::array<std::byte, kMost> bytes{};

    bool is_in() const noexcept { return (endpoint & 0x80) != 0; }
    std::span<const std::byte> received() const noexcept { return {bytes.data(), moved}; }
};

// One opened device. The transport owns a few transfers and their memory, so that submitting,
// completing and cancelling allocate nothing beyond what a library does for itself, and no memory
// in flight is ever freed. For one thread at a time, halt() apart. No member but prepare_halt()
// throws.
class Transport {
 public:
    static constexpr size_t kTransfers = 6;

    virtual ~Transport() = default; // cancels and reaps what is in flight
    Transport() = default;
    Transport(const Transport&) = delete;
    Transport& operator=(const Transport&) = delete;

    Transfer& transfer(size_t slot) noexcept { return transfers_[slot]; }

    // Begins a transfer that is not pending. It is pending afterwards, or has failed already.
    virtual void submit(Transfer& transfer) noexcept = 0;
    // A pending transfer ends soon, as cancelled or as it would have.
    virtual void cancel(Transfer& transfer) noexcept = 0;
    // Ends transfers that are over. Where none is, waits until one is or until it is until_ns;
    // a time in the past does not wait. True: at least one ended.
    virtual bool reap(int64_t until_ns) noexcept = 0;
    bool gone() const noexcept { return gone_; } // the device is unplugged; for ever
    // The clock of until_ns: the monotonic one, or that of a test.
    virtual Clock& clock() noexcept = 0;

    // The message that halt() sends to an endpoint past all transfers (raw_halt.h).
    virtual Result<void> prepare_halt(uint8_t endpoint, std::span<const std::byte> message) = 0;
    // From any thread and from a signal's handler. False: the message did not go out.
    virtual bool halt() noexcept = 0;

 protected:
    // How every submit() begins: the transfer is pending and its time runs. False: the device is
    // gone, and so is the transfer.
    bool begin(Transfer& transfer) noexcept;
    // The device is gone, and with it all that is pending.
    void lose() noexcept;
    size_t slot_of(const Transfer& transfer) const noexcept {
        return static_cast<size_t>(&transfer - transfers_.data());
    }
    // When a pending transfer has timed out; kNever_ns where it has no timeout.
    int64_t due_ns(const Transfer& transfer) const noexcept { return due_ns_[slot_of(transfer)]; }
    bool any_pending() const noexcept;

    static constexpr int64_t kNever_ns = std::numeric_limits<int64_t>::max();
    std::array<Transfer, kTransfers> transfers_;
    bool gone_ = false;

 private:
    std::array<int64_t, kTransfers> due_ns_{};
};

// Submits `transfer` and waits for its end, at most for `patience_ns`; then it is cancelled and
// counts as timed out. For set-up, not for ticks.
TransferStatus run_transfer(Transport& transport, Transfer& transfer, int64_t patience_ns) noexcept;

// "timed out"
const char* text_of(TransferStatus status) noexcept;

} // namespace palpate::haptics
