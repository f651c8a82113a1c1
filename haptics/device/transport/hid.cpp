#include "haptics/device/transport/hid.h"

#include <fcntl.h>
#include <hidapi.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <utility>

#include "engine/base/assert.h"
#include "engine/base/fd.h"
#include "haptics/core/raw_halt.h"

namespace palpate::haptics {

namespace {

class HidTransport final : public Transport {
 public:
    // `own`: a second descriptor of the same node, for halts.
    HidTransport(hid_device* device, Fd own) : device_(device), own_(std::move(own)) {}
    ~HidTransport() override { hid_close(device_); }

    void submit(Transfer& transfer) noexcept override;
    void cancel(Transfer& transfer) noexcept override {
        is_cancelled_ = is_cancelled_ || in_ == &transfer;
    }
    bool reap(int64_t until_ns) noexcept override;
    Clock& clock() noexcept override { return monotonic_clock(); }
    Result<void> prepare_halt(uint8_t, std::span<const std::byte> message) override {
        return halt_.by_write(own_.get(), message);
    }
    bool halt() noexcept override { return halt_.send(); }

 private:
    bool look(int64_t until_ns) noexcept;
    bool is_unplugged() const noexcept;

    hid_device* device_;
    Fd own_;
    Transfer* in_ = nullptr; // in flight
    bool is_cancelled_ = false;
    RawHalt halt_;
};

// The library does not tell why a report could not be written.
bool HidTransport::is_unplugged() const noexcept {
    pollfd state{.fd = own_.get(), .events = 0, .revents = 0};
    return ::poll(&state, 1, 0) == 1 && (state.revents & (POLLERR | POLLHUP)) != 0;
}

void HidTransport::submit(Transfer& transfer) noexcept {
    if (!begin(transfer))
        return;
    if (transfer.is_in()) {
        PALPATE_ASSERT(in_ == nullptr);
        in_ = &transfer;
        is_cancelled_ = false;
        return;
    }
    const int sent =
        hid_write(device_, reinterpret_cast<const uint8_t*>(transfer.bytes.data()), transfer.size);
    transfer.moved = std::min(static_cast<size_t>(std::max(sent, 0)), transfer.size);
    if (sent < 0 && is_unplugged()) {
        lose();
        in_ = nullptr;
    } else {
        transfer.status =
            transfer.moved == transfer.size ? TransferStatus::done : TransferStatus::failed;
    }
}

// Waits for the report in flight, where there is one, or until its time is over. True: it ended.
bool HidTransport::look(int64_t until_ns) noexcept {
    if (!in_)
        return false;
    const int64_t left_ns = std::min(until_ns, due_ns(*in_)) - monotonic_ns();
    constexpr int64_t kMs = 1'000'000, kMost_ms = 1000;
    const int64_t wait_ms =
        is_cancelled_ || left_ns <= 0 ? 0 : std::min((left_ns + kMs - 1) / kMs, kMost_ms);
    const int came = hid_read_timeout(device_, reinterpret_cast<uint8_t*>(in_->bytes.data()),
                                      in_->size, static_cast<int>(wait_ms));
    if (came > 0) {
        in_->moved = static_cast<size_t>(came);
        std::exchange(in_, nullptr)->status = TransferStatus::done;
        return true;
    }
    if (came < 0) {
        lose();
        in_ = nullptr;
        return true;
    }
    if (!is_cancelled_ && monotonic_ns() < due_ns(*in_))
        return false;
    std::exchange(in_, nullptr)->status =
        is_cancelled_ ? TransferStatus::cancelled : TransferStatus::timed_out;
    return true;
}

bool HidTransport::reap(int64_t until_ns) noexcept {
    for (;;) {
        if (look(until_ns))
            return true;
        if (!in_)
            sleep_until(until_ns);
        if (gone() || monotonic_ns() >= until_ns)
            return false;
    }
}

} // namespace

const char* hid_refusal() noexcept {
    return nullptr;
}

std::vector<Plugged> plugged_hid() {
    std::vector<Plugged> all;
    hid_device_info* const first = hid_enumerate(0, 0);
    for (const hid_device_info* at = first; at; at = at->next)
        if (at->path)
            all.push_back({.vendor = at->vendor_id,
                           .product = at->product_id,
                           .node = at->path,
                           .refusal = refusal_of_node(at->path)});
    hid_free_enumeration(first);
    std::sort(all.begin(), all.end(),
              [](const Plugged& a, const Plugged& b) { return a.node < b.node; });
    // The library lists a device once for each of its usages.
    all.erase(std::unique(all.begin(), all.end(),
                          [](const Plugged& a, const Plugged& b) { return a.node == b.node; }),
              all.end());
    return all;
}

std::vector<std::byte> report_descriptor(const std::string& node) {
    constexpr size_t kMost = 4096; // of the kernel
    std::vector<std::byte> bytes(kMost);
    const std::filesystem::path name = std::filesystem::path(node).filename();
    std::ifstream file("/sys/class/hidraw" / name / "device/report_descriptor", std::ios::binary);
    file.read(reinterpret_cast<char*>(bytes.data()), kMost);
    bytes.resize(static_cast<size_t>(file.gcount()));
    return bytes;
}

Result<std::unique_ptr<Transport>> open_hid(const std::string& node) {
    Fd own(::open(node.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK));
    if (!own)
        return fail("{}", refusal_of_node(node, errno));
    hid_device* const device = hid_open_path(node.c_str());
    if (!device)
        return fail("{}: cannot be used: it is no HID device, or hidapi refuses it", node);
    return std::make_unique<HidTransport>(device, std::move(own));
}

} // namespace palpate::haptics
