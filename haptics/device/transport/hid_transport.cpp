#include "haptics/device/transport/hid_transport.h"

#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "engine/base/assert.h"

namespace palpate::haptics {

Result<std::unique_ptr<HidTransport>> HidTransport::open(const std::string& node) {
    Fd fd(::open(node.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));
    if (!fd)
        return fail("{}: {}", node,
                    errno == EACCES || errno == EPERM
                        ? "no permission; install Palpate's udev rules (70-palpate.rules) and plug "
                          "the device in again"
                        : ::strerror(errno));
    return std::make_unique<HidTransport>(std::move(fd));
}

void HidTransport::lose() noexcept {
    gone_ = true;
    if (in_)
        std::exchange(in_, nullptr)->status = TransferStatus::gone;
}

void HidTransport::submit(Transfer& transfer) noexcept {
    PALPATE_ASSERT(transfer.status != TransferStatus::pending);
    PALPATE_ASSERT_CMP(transfer.size, <=, Transfer::kMost);
    transfer.moved = 0;
    if (gone_) {
        transfer.status = TransferStatus::gone;
        return;
    }
    if (transfer.is_in()) {
        PALPATE_ASSERT(in_ == nullptr);
        in_ = &transfer;
        is_cancelled_ = false;
        due_ns_ = transfer.timeout_ns > 0 ? monotonic_ns() + transfer.timeout_ns : 0;
        transfer.status = TransferStatus::pending;
        return;
    }
    const ssize_t sent = ::write(fd_.get(), transfer.bytes.data(), transfer.size);
    const int error = errno;
    transfer.moved = static_cast<size_t>(std::max<ssize_t>(sent, 0));
    transfer.status = transfer.moved == transfer.size ? TransferStatus::done
                      : error == EAGAIN               ? TransferStatus::timed_out
                      : error == EPIPE                ? TransferStatus::stalled
                                                      : TransferStatus::failed;
    if (sent < 0 && (error == ENODEV || error == EIO || error == ECONNRESET)) {
        transfer.status = TransferStatus::gone;
        lose();
    }
}

void HidTransport::cancel(Transfer& transfer) noexcept {
    is_cancelled_ = is_cancelled_ || in_ == &transfer;
}

// Whether the incoming transfer is over.
bool HidTransport::look() noexcept {
    if (!in_)
        return false;
    const ssize_t came = ::read(fd_.get(), in_->bytes.data(), in_->size);
    if (came > 0) {
        in_->moved = static_cast<size_t>(came);
        std::exchange(in_, nullptr)->status = TransferStatus::done;
        return true;
    }
    if (came == 0 || (errno != EAGAIN && errno != EINTR)) {
        lose();
        return true;
    }
    const bool is_late = due_ns_ != 0 && monotonic_ns() >= due_ns_;
    if (!is_cancelled_ && !is_late)
        return false;
    std::exchange(in_, nullptr)->status =
        is_cancelled_ ? TransferStatus::cancelled : TransferStatus::timed_out;
    return true;
}

bool HidTransport::reap(int64_t until_ns) noexcept {
    for (;;) {
        if (look())
            return true;
        const int64_t now_ns = monotonic_ns();
        if (gone_ || now_ns >= until_ns)
            return false;
        const int64_t wake_ns = in_ && due_ns_ != 0 ? std::min(until_ns, due_ns_) : until_ns;
        const int64_t left_ns = std::max<int64_t>(wake_ns - now_ns, 0);
        const timespec wait{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
        pollfd ready{.fd = fd_.get(), .events = POLLIN, .revents = 0};
        ::ppoll(&ready, in_ ? 1 : 0, &wait, nullptr);
    }
}

Result<void> HidTransport::prepare_halt(uint8_t, std::span<const std::byte> message) {
    return halt_.by_write(fd_.get(), message);
}

} // namespace palpate::haptics
