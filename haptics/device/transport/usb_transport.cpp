#include "haptics/device/transport/usb_transport.h"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>

#include "engine/base/assert.h"

namespace palpate::haptics {

namespace {

TransferStatus status_of(int error, bool is_late) {
    switch (error) {
        case 0:
            return TransferStatus::done;
        case ENOENT:
        case ECONNRESET:
            return is_late ? TransferStatus::timed_out : TransferStatus::cancelled;
        case EPIPE:
            return TransferStatus::stalled;
        case EOVERFLOW:
            return TransferStatus::overflowed;
        case ENODEV:
        case ESHUTDOWN:
            return TransferStatus::gone;
        default:
            return TransferStatus::failed;
    }
}

std::string why_not_claimed(const Fd& fd, unsigned interface, int error) {
    if (error != EBUSY)
        return ::strerror(error);
    usbdevfs_getdriver driver{.interface = interface, .driver = {}};
    if (::ioctl(fd.get(), USBDEVFS_GETDRIVER, &driver) == 0 &&
        std::string_view(driver.driver) != "usbfs")
        return fmt::format("the kernel's driver {} holds it", driver.driver);
    return "another program uses it";
}

} // namespace

Result<std::unique_ptr<UsbTransport>> UsbTransport::open(const std::string& node,
                                                         unsigned interface) {
    Fd fd(::open(node.c_str(), O_RDWR | O_CLOEXEC));
    if (!fd)
        return fail("{}: {}", node,
                    errno == EACCES || errno == EPERM
                        ? "no permission; install Palpate's udev rules (70-palpate.rules) and plug "
                          "the device in again"
                        : ::strerror(errno));
    if (::ioctl(fd.get(), USBDEVFS_CLAIMINTERFACE, &interface) != 0)
        return fail("{}: cannot be used: {}", node, why_not_claimed(fd, interface, errno));
    return std::unique_ptr<UsbTransport>(new UsbTransport(std::move(fd), interface));
}

UsbTransport::UsbTransport(Fd fd, unsigned interface) : fd_(std::move(fd)), interface_(interface) {
    for (Flight& flight : flights_)
        flight.urb = std::make_unique<usbdevfs_urb>();
}

UsbTransport::~UsbTransport() {
    for (Transfer& transfer : transfers_)
        cancel(transfer);
    constexpr int64_t kPatience_ns = 50'000'000;
    const int64_t until_ns = monotonic_ns() + kPatience_ns;
    while (any_pending() && !gone_ && monotonic_ns() < until_ns)
        reap(until_ns);
    ::ioctl(fd_.get(), USBDEVFS_RELEASEINTERFACE, &interface_);
}

bool UsbTransport::any_pending() const noexcept {
    return std::any_of(transfers_.begin(), transfers_.end(), [](const Transfer& transfer) {
        return transfer.status == TransferStatus::pending;
    });
}

void UsbTransport::submit(Transfer& transfer) noexcept {
    const auto slot = static_cast<size_t>(&transfer - transfers_.data());
    PALPATE_ASSERT(slot < kTransfers && transfer.status != TransferStatus::pending);
    PALPATE_ASSERT_CMP(transfer.size, <=, Transfer::kMost);
    transfer.moved = 0;
    if (gone_) {
        transfer.status = TransferStatus::gone;
        return;
    }
    Flight& flight = flights_[slot];
    const bool is_control = transfer.kind == TransferKind::control;
    const size_t before = is_control ? kSetup : 0;
    if (is_control) {
        const UsbSetup& setup = transfer.setup;
        const auto low = [](unsigned value) { return static_cast<std::byte>(value & 0xFF); };
        const std::array<std::byte, kSetup> head{std::byte{setup.type},
                                                 std::byte{setup.request},
                                                 low(setup.value),
                                                 low(setup.value >> 8u),
                                                 low(setup.index),
                                                 low(setup.index >> 8u),
                                                 low(static_cast<unsigned>(transfer.size)),
                                                 low(static_cast<unsigned>(transfer.size) >> 8u)};
        std::copy(head.begin(), head.end(), flight.bytes.begin());
    }
    if (!transfer.is_in())
        std::copy_n(transfer.bytes.begin(), transfer.size,
                    flight.bytes.begin() + static_cast<long>(before));
    usbdevfs_urb& urb = *flight.urb;
    urb = {};
    urb.type = is_control                                 ? USBDEVFS_URB_TYPE_CONTROL
               : transfer.kind == TransferKind::interrupt ? USBDEVFS_URB_TYPE_INTERRUPT
                                                          : USBDEVFS_URB_TYPE_BULK;
    urb.endpoint = is_control ? 0 : transfer.endpoint;
    urb.buffer = flight.bytes.data();
    urb.buffer_length = static_cast<int>(before + transfer.size);
    urb.usercontext = &transfer;
    flight.due_ns = transfer.timeout_ns > 0 ? monotonic_ns() + transfer.timeout_ns : 0;
    flight.is_late = false;
    transfer.status = TransferStatus::pending;
    if (::ioctl(fd_.get(), USBDEVFS_SUBMITURB, &urb) != 0) {
        transfer.status = status_of(errno, false);
        if (transfer.status == TransferStatus::gone)
            lose_all();
        else if (transfer.status == TransferStatus::cancelled)
            transfer.status = TransferStatus::failed;
    }
}

void UsbTransport::cancel(Transfer& transfer) noexcept {
    if (transfer.status == TransferStatus::pending)
        ::ioctl(fd_.get(), USBDEVFS_DISCARDURB,
                flights_[static_cast<size_t>(&transfer - transfers_.data())].urb.get());
}

void UsbTransport::lose_all() noexcept {
    gone_ = true;
    for (Transfer& transfer : transfers_)
        if (transfer.status == TransferStatus::pending)
            transfer.status = TransferStatus::gone;
}

// One transfer that is over. False: none is.
bool UsbTransport::take_one() noexcept {
    usbdevfs_urb* urb = nullptr;
    if (::ioctl(fd_.get(), USBDEVFS_REAPURBNDELAY, &urb) != 0) {
        if (errno != ENODEV || gone_)
            return false;
        const bool any = any_pending();
        lose_all();
        return any;
    }
    Transfer& transfer = *static_cast<Transfer*>(urb->usercontext);
    const Flight& flight = flights_[static_cast<size_t>(&transfer - transfers_.data())];
    const size_t before = transfer.kind == TransferKind::control ? kSetup : 0;
    transfer.status = status_of(-urb->status, flight.is_late);
    transfer.moved = std::min(static_cast<size_t>(std::max(urb->actual_length, 0)), transfer.size);
    if (transfer.is_in())
        std::copy_n(flight.bytes.begin() + static_cast<long>(before), transfer.moved,
                    transfer.bytes.begin());
    if (transfer.status == TransferStatus::gone)
        lose_all();
    return true;
}

bool UsbTransport::reap(int64_t until_ns) noexcept {
    for (;;) {
        bool any = false;
        while (!gone_ && take_one())
            any = true;
        const int64_t now_ns = monotonic_ns();
        int64_t wake_ns = until_ns;
        for (size_t slot = 0; slot < kTransfers; ++slot) {
            Flight& flight = flights_[slot];
            if (transfers_[slot].status != TransferStatus::pending || flight.due_ns == 0 ||
                flight.is_late)
                continue;
            wake_ns = std::min(wake_ns, flight.due_ns);
            if (now_ns >= flight.due_ns) {
                flight.is_late = true;
                cancel(transfers_[slot]);
            }
        }
        if (any || gone_ || now_ns >= until_ns)
            return any;
        const int64_t left_ns = std::max<int64_t>(wake_ns - now_ns, 0);
        const timespec wait{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
        pollfd ready{.fd = fd_.get(), .events = POLLOUT, .revents = 0}; // a transfer is over
        ::ppoll(&ready, 1, &wait, nullptr);
    }
}

Result<void> UsbTransport::prepare_halt(uint8_t endpoint, std::span<const std::byte> message) {
    return halt_.by_usb(fd_.get(), endpoint, message);
}

} // namespace palpate::haptics
