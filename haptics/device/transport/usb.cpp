#include "haptics/device/transport/usb.h"

#include <fcntl.h>
#include <libusb.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>

#include "engine/base/fd.h"
#include "haptics/core/raw_halt.h"

namespace palpate::haptics {

namespace {

template <auto destroy>
struct Destroy {
    template <class T>
    void operator()(T* object) const {
        destroy(object);
    }
};
using Context = std::unique_ptr<libusb_context, Destroy<libusb_exit>>;
using Handle = std::unique_ptr<libusb_device_handle, Destroy<libusb_close>>;
using OwnedTransfer = std::unique_ptr<libusb_transfer, Destroy<libusb_free_transfer>>;

Context make_context() {
    libusb_context* made = nullptr;
    return Context(libusb_init(&made) == 0 ? made : nullptr);
}

TransferStatus status_of(libusb_transfer_status status, bool is_late) {
    switch (status) {
        case LIBUSB_TRANSFER_COMPLETED:
            return TransferStatus::done;
        case LIBUSB_TRANSFER_CANCELLED:
            return is_late ? TransferStatus::timed_out : TransferStatus::cancelled;
        case LIBUSB_TRANSFER_TIMED_OUT:
            return TransferStatus::timed_out;
        case LIBUSB_TRANSFER_STALL:
            return TransferStatus::stalled;
        case LIBUSB_TRANSFER_OVERFLOW:
            return TransferStatus::overflowed;
        case LIBUSB_TRANSFER_NO_DEVICE:
            return TransferStatus::gone;
        case LIBUSB_TRANSFER_ERROR:
            break;
    }
    return TransferStatus::failed;
}

class UsbTransport final : public Transport {
 public:
    static Result<std::unique_ptr<Transport>> open(const std::string& node, int interface);
    ~UsbTransport() override;

    void submit(Transfer& transfer) noexcept override;
    void cancel(Transfer& transfer) noexcept override;
    bool reap(int64_t until_ns) noexcept override;
    Clock& clock() noexcept override { return monotonic_clock(); }
    Result<void> prepare_halt(uint8_t endpoint, std::span<const std::byte> message) override {
        return halt_.by_usb(fd_.get(), endpoint, message);
    }
    bool halt() noexcept override { return halt_.send(); }

 private:
    struct Flight {
        UsbTransport* owner = nullptr;
        OwnedTransfer own;
        std::array<uint8_t, LIBUSB_CONTROL_SETUP_SIZE + Transfer::kMost> control;
        bool is_late = false;
    };

    UsbTransport(Fd fd, Context context) : fd_(std::move(fd)), context_(std::move(context)) {}
    void watch();
    static void LIBUSB_CALL on_end(libusb_transfer* own);
    void end(Transfer& transfer, Flight& flight) noexcept;

    // In this order: the handle closes before what was in flight and what it stands on go.
    Fd fd_;
    Context context_;
    std::array<Flight, kTransfers> flights_{};
    Handle handle_;
    int interface_ = -1; // that is claimed
    bool any_ended_ = false;
    std::array<pollfd, 8> watched_{}; // descriptors of the library
    size_t watched_count_ = 0;
    RawHalt halt_;
};

Result<std::unique_ptr<Transport>> UsbTransport::open(const std::string& node, int interface) {
    // Opened here, so that halts go out by the descriptor that holds the interface.
    Fd fd(::open(node.c_str(), O_RDWR | O_CLOEXEC));
    if (!fd)
        return fail("{}", refusal_of_node(node, errno));
    Context context = make_context();
    if (!context)
        return fail("{}: libusb does not start", node);
    std::unique_ptr<UsbTransport> made(new UsbTransport(std::move(fd), std::move(context)));
    libusb_device_handle* handle = nullptr;
    if (const int error = libusb_wrap_sys_device(made->context_.get(), made->fd_.get(), &handle);
        error != 0)
        return fail("{}: cannot be used: {}", node, libusb_strerror(error));
    made->handle_.reset(handle);
    if (const int error = libusb_claim_interface(handle, interface); error != 0)
        return fail("{}: cannot be used: {}", node,
                    error != LIBUSB_ERROR_BUSY ? libusb_strerror(error)
                    : libusb_kernel_driver_active(handle, interface) == 1
                        ? "the kernel's driver holds it"
                        : "another program uses it");
    made->interface_ = interface;
    for (Flight& flight : made->flights_) {
        flight.owner = made.get();
        flight.own.reset(libusb_alloc_transfer(0));
        if (!flight.own)
            return fail("{}: cannot be used: no memory", node);
    }
    made->watch();
    return made;
}

// The library's own waiting is in milliseconds, which is a tick.
void UsbTransport::watch() {
    const libusb_pollfd** all = libusb_get_pollfds(context_.get());
    for (const libusb_pollfd** at = all; at && *at && watched_count_ < watched_.size(); ++at)
        watched_[watched_count_++] = {.fd = (*at)->fd, .events = (*at)->events, .revents = 0};
    libusb_free_pollfds(all);
}

UsbTransport::~UsbTransport() {
    for (Transfer& transfer : transfers_)
        cancel(transfer);
    constexpr int64_t kPatience_ns = 50'000'000;
    const int64_t until_ns = monotonic_ns() + kPatience_ns;
    while (any_pending() && !gone() && monotonic_ns() < until_ns)
        reap(until_ns);
    if (interface_ >= 0)
        libusb_release_interface(handle_.get(), interface_);
}

void UsbTransport::on_end(libusb_transfer* own) {
    Flight& flight = *static_cast<Flight*>(own->user_data);
    UsbTransport& transport = *flight.owner;
    transport.end(transport.transfers_[static_cast<size_t>(&flight - transport.flights_.data())],
                  flight);
}

void UsbTransport::end(Transfer& transfer, Flight& flight) noexcept {
    if (transfer.status != TransferStatus::pending)
        return; // went with the device
    transfer.status = status_of(flight.own->status, flight.is_late);
    transfer.moved =
        std::min(static_cast<size_t>(std::max(flight.own->actual_length, 0)), transfer.size);
    if (transfer.kind == TransferKind::control && transfer.is_in())
        std::copy_n(std::as_bytes(std::span(flight.control)).begin() + LIBUSB_CONTROL_SETUP_SIZE,
                    transfer.moved, transfer.bytes.begin());
    if (transfer.status == TransferStatus::gone)
        lose();
    any_ended_ = true;
}

void UsbTransport::submit(Transfer& transfer) noexcept {
    if (!begin(transfer))
        return;
    Flight& flight = flights_[slot_of(transfer)];
    flight.is_late = false;
    auto* const bytes = reinterpret_cast<uint8_t*>(transfer.bytes.data());
    const auto size = static_cast<int>(transfer.size);
    if (transfer.kind == TransferKind::control) {
        const UsbSetup& setup = transfer.setup;
        libusb_fill_control_setup(flight.control.data(), setup.type, setup.request, setup.value,
                                  setup.index, static_cast<uint16_t>(size));
        std::copy_n(bytes, size, flight.control.data() + LIBUSB_CONTROL_SETUP_SIZE);
        libusb_fill_control_transfer(flight.own.get(), handle_.get(), flight.control.data(), on_end,
                                     &flight, 0);
    } else if (transfer.kind == TransferKind::interrupt) {
        libusb_fill_interrupt_transfer(flight.own.get(), handle_.get(), transfer.endpoint, bytes,
                                       size, on_end, &flight, 0);
    } else {
        libusb_fill_bulk_transfer(flight.own.get(), handle_.get(), transfer.endpoint, bytes, size,
                                  on_end, &flight, 0);
    }
    const int error = libusb_submit_transfer(flight.own.get());
    if (error == LIBUSB_ERROR_NO_DEVICE)
        lose();
    else if (error != 0)
        transfer.status = TransferStatus::failed;
}

void UsbTransport::cancel(Transfer& transfer) noexcept {
    if (transfer.status == TransferStatus::pending &&
        libusb_cancel_transfer(flights_[slot_of(transfer)].own.get()) == LIBUSB_ERROR_NO_DEVICE)
        lose();
}

bool UsbTransport::reap(int64_t until_ns) noexcept {
    any_ended_ = false;
    for (;;) {
        timeval none{};
        libusb_handle_events_timeout_completed(context_.get(), &none, nullptr);
        const int64_t now_ns = monotonic_ns();
        int64_t wake_ns = until_ns;
        for (Transfer& transfer : transfers_) {
            Flight& flight = flights_[slot_of(transfer)];
            if (transfer.status != TransferStatus::pending || flight.is_late)
                continue;
            wake_ns = std::min(wake_ns, due_ns(transfer));
            if (now_ns >= due_ns(transfer)) {
                flight.is_late = true;
                cancel(transfer);
            }
        }
        if (any_ended_ || gone() || now_ns >= until_ns)
            return any_ended_;
        const int64_t left_ns = std::max<int64_t>(wake_ns - now_ns, 0);
        const timespec wait{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
        ::ppoll(watched_.data(), watched_count_, &wait, nullptr);
    }
}

} // namespace

const char* usb_refusal() noexcept {
    return nullptr;
}

std::vector<Plugged> plugged_usb() {
    std::vector<Plugged> all;
    const Context context = make_context();
    if (!context)
        return all;
    libusb_device** devices = nullptr;
    const ssize_t count = libusb_get_device_list(context.get(), &devices);
    for (ssize_t i = 0; i < count; ++i) {
        libusb_device_descriptor descriptor{};
        if (libusb_get_device_descriptor(devices[i], &descriptor) != 0)
            continue;
        Plugged found{
            .vendor = descriptor.idVendor,
            .product = descriptor.idProduct,
            .node = fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(devices[i]),
                                libusb_get_device_address(devices[i])),
            .refusal = {}};
        found.refusal = refusal_of_node(found.node);
        all.push_back(std::move(found));
    }
    if (count >= 0)
        libusb_free_device_list(devices, 1);
    std::sort(all.begin(), all.end(),
              [](const Plugged& a, const Plugged& b) { return a.node < b.node; });
    return all;
}

Result<std::unique_ptr<Transport>> open_usb(const std::string& node, int interface) {
    return UsbTransport::open(node, interface);
}

} // namespace palpate::haptics
