#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/base/error.h"
#include "engine/base/fd.h"

namespace palpate::haptics {

// How a driver's halt() reaches the device although its library holds a lock: one message that ends
// all force, prepared when the device was opened, and one system call on a descriptor of its own.
// docs/decisions/11-halting-a-device.md says why.
//
// The message goes beside whatever the library is sending. On one endpoint the kernel keeps the
// order, so that a message sent after a write has returned takes that write back.
class RawHalt {
 public:
    static constexpr size_t kMost = 65;           // bytes of a message: a HID report and its number
    static constexpr uint32_t kUsbTimeout_ms = 5; // the longest that send() waits by USB

    // For hidraw and serial lines: the message is written to a copy of `fd` where that takes it
    // without waiting. At most kMost bytes.
    Result<void> by_write(int fd, std::span<const std::byte> message);
    // For a node of usbfs that is open and whose interface is claimed, as a library has it that was
    // given its descriptor (libusb_wrap_sys_device): a transfer to a bulk or interrupt endpoint.
    Result<void> by_usb(int fd, uint8_t endpoint, std::span<const std::byte> message);

    // Sends it. From any thread, from a signal's handler, and any number of times, also at once: it
    // neither allocates, throws nor locks, leaves errno as it was, and waits for kUsbTimeout_ms at
    // most. False: nothing was prepared, or the kernel did not take it.
    bool send() const noexcept;

 private:
    Result<void> prepare(int fd, std::span<const std::byte> message);

    Fd fd_;
    bool usb_ = false;
    uint8_t endpoint_ = 0;
    std::array<std::byte, kMost> message_{};
    size_t size_ = 0;
};

} // namespace palpate::haptics
