#include "haptics/device/transport/fake_transport.h"

namespace palpate::haptics {

void FakeTransport::submit(Transfer& transfer) noexcept {
    if (!begin(transfer))
        return;
    is_cancelled_[slot_of(transfer)] = false;
    order_[ordered_++] = slot_of(transfer);
}

void FakeTransport::cancel(Transfer& transfer) noexcept {
    is_cancelled_[slot_of(transfer)] = true; // noticed by the next round
}

// True: it is over.
bool FakeTransport::end_one(Transfer& transfer) {
    const int64_t now_ns = clock_.now_ns();
    if (gone_) {
        transfer.status = TransferStatus::gone;
        return true;
    }
    if (is_cancelled_[slot_of(transfer)]) {
        transfer.status = TransferStatus::cancelled;
        return true;
    }
    const std::span<std::byte> bytes(transfer.bytes.data(), transfer.size);
    if (transfer.is_in()) {
        const int came = peer_.in(transfer.endpoint, bytes);
        if (came >= 0) {
            transfer.moved = static_cast<size_t>(came);
            transfer.status = TransferStatus::done;
            if (fault_)
                fault_(transfer, now_ns);
        }
    } else {
        transfer.status = TransferStatus::done;
        transfer.moved = transfer.size;
        if (fault_)
            fault_(transfer, now_ns);
        if (transfer.status == TransferStatus::done) {
            const bool taken = transfer.kind == TransferKind::control
                                   ? peer_.control(transfer.setup, bytes.first(transfer.moved))
                                   : peer_.out(transfer.endpoint, bytes.first(transfer.moved));
            if (!taken)
                transfer.status = transfer.kind == TransferKind::control ? TransferStatus::stalled
                                                                         : TransferStatus::pending;
        }
    }
    if (transfer.status == TransferStatus::pending && now_ns >= due_ns(transfer))
        transfer.status = TransferStatus::timed_out;
    return transfer.status != TransferStatus::pending;
}

// One look of the host at everything in flight, in the order of submission.
bool FakeTransport::round() {
    if (!gone_)
        peer_.advance(clock_.now_ns());
    size_t left = 0;
    const size_t before = ordered_;
    for (size_t i = 0; i < before; ++i)
        if (!end_one(transfers_[order_[i]]))
            order_[left++] = order_[i];
    ordered_ = left;
    // Transfers that were submitted before a halt go out before it.
    for (uint32_t n = halts_.exchange(0, std::memory_order_acq_rel); n > 0 && !gone_; --n)
        peer_.out(halt_endpoint_, halt_message_);
    return left < before;
}

bool FakeTransport::reap(int64_t until_ns) noexcept {
    bool any = round();
    while (!any && clock_.now_ns() < until_ns) {
        clock_.sleep_until(std::min(until_ns, clock_.now_ns() + kPoll_ns));
        any = round();
    }
    return any;
}

Result<void> FakeTransport::prepare_halt(uint8_t endpoint, std::span<const std::byte> message) {
    halt_endpoint_ = endpoint;
    halt_message_.assign(message.begin(), message.end());
    return {};
}

bool FakeTransport::halt() noexcept {
    if (gone_ || halt_message_.empty())
        return false;
    halts_.fetch_add(1, std::memory_order_acq_rel);
    return true;
}

} // namespace palpate::haptics
