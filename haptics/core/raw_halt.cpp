#include "haptics/core/raw_halt.h"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace palpate::haptics {

Result<void> RawHalt::prepare(int fd, std::span<const std::byte> message) {
    if (message.empty() || message.size() > kMost)
        return fail("a message that halts a device: expected 1 to {} bytes, found {}", kMost,
                    message.size());
    // Its own number: a library that closes its own does not let another file have it.
    Fd own(::fcntl(fd, F_DUPFD_CLOEXEC, 0));
    if (!own)
        return fail("a descriptor that halts a device: {}", ::strerror(errno));
    fd_ = std::move(own);
    std::copy(message.begin(), message.end(), message_.begin());
    size_ = message.size();
    return {};
}

Result<void> RawHalt::by_write(int fd, std::span<const std::byte> message) {
    usb_ = false;
    return prepare(fd, message);
}

Result<void> RawHalt::by_usb(int fd, uint8_t endpoint, std::span<const std::byte> message) {
    usb_ = true;
    endpoint_ = endpoint;
    return prepare(fd, message);
}

bool RawHalt::send() const noexcept {
    if (!fd_)
        return false;
    const int before = errno;
    ssize_t sent = -1;
    if (usb_) {
        usbdevfs_bulktransfer transfer{.ep = endpoint_,
                                       .len = static_cast<unsigned>(size_),
                                       .timeout = kUsbTimeout_ms,
                                       .data = const_cast<std::byte*>(message_.data())};
        sent = ::ioctl(fd_.get(), USBDEVFS_BULK, &transfer);
    } else if (pollfd takes{.fd = fd_.get(), .events = POLLOUT, .revents = 0};
               ::poll(&takes, 1, 0) == 1 && (takes.revents & POLLOUT)) {
        sent = ::write(fd_.get(), message_.data(), size_);
    }
    errno = before;
    return sent == static_cast<ssize_t>(size_);
}

} // namespace palpate::haptics
