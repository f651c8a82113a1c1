#include "haptics/device/transport/transport.h"

#include <algorithm>

#include "engine/base/assert.h"

namespace palpate::haptics {

namespace {

constexpr int64_t kReapCancelled_ns =
    50'000'000; // the longest that a cancelled transfer is awaited

} // namespace

bool Transport::begin(Transfer& transfer) noexcept {
    PALPATE_ASSERT(slot_of(transfer) < kTransfers && transfer.status != TransferStatus::pending);
    PALPATE_ASSERT_CMP(transfer.size, <=, Transfer::kMost);
    transfer.moved = 0;
    transfer.status = gone_ ? TransferStatus::gone : TransferStatus::pending;
    due_ns_[slot_of(transfer)] =
        transfer.timeout_ns > 0 ? clock().now_ns() + transfer.timeout_ns : kNever_ns;
    return !gone_;
}

void Transport::lose() noexcept {
    gone_ = true;
    for (Transfer& transfer : transfers_)
        if (transfer.status == TransferStatus::pending)
            transfer.status = TransferStatus::gone;
}

bool Transport::any_pending() const noexcept {
    return std::any_of(transfers_.begin(), transfers_.end(), [](const Transfer& transfer) {
        return transfer.status == TransferStatus::pending;
    });
}

TransferStatus run_transfer(Transport& transport, Transfer& transfer,
                            int64_t patience_ns) noexcept {
    transport.submit(transfer);
    Clock& clock = transport.clock();
    const int64_t until_ns = clock.now_ns() + patience_ns;
    while (transfer.status == TransferStatus::pending && clock.now_ns() < until_ns)
        transport.reap(until_ns);
    if (transfer.status != TransferStatus::pending)
        return transfer.status;
    transport.cancel(transfer);
    const int64_t end_ns = clock.now_ns() + kReapCancelled_ns;
    while (transfer.status == TransferStatus::pending && clock.now_ns() < end_ns)
        transport.reap(end_ns);
    // A transfer may have ended just before it was cancelled.
    return transfer.status == TransferStatus::done ? transfer.status : TransferStatus::timed_out;
}

const char* text_of(TransferStatus status) noexcept {
    switch (status) {
        case TransferStatus::idle:
            return "not begun";
        case TransferStatus::pending:
            return "not finished";
        case TransferStatus::done:
            return "done";
        case TransferStatus::timed_out:
            return "timed out";
        case TransferStatus::stalled:
            return "refused by the device (stall)";
        case TransferStatus::overflowed:
            return "more bytes than expected";
        case TransferStatus::cancelled:
            return "cancelled";
        case TransferStatus::gone:
            return "device unplugged";
        case TransferStatus::failed:
            break;
    }
    return "refused by the system";
}

} // namespace palpate::haptics
