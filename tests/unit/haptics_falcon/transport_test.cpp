#include <gtest/gtest.h>

#include <deque>

#include "haptics/device/transport/fake_transport.h"

namespace palpate::haptics {
namespace {

constexpr int64_t kMs = 1'000'000;

// Gives back what it was sent, `delay_ns` later.
class Echo final : public FakePeer {
 public:
    int64_t delay_ns = kMs, now_ns = 0;
    bool takes = true, refuses = false;
    std::vector<std::byte> last;

    void advance(int64_t to_ns) override { now_ns = to_ns; }
    bool control(const UsbSetup&, std::span<const std::byte>) override { return !refuses; }
    bool out(uint8_t, std::span<const std::byte> bytes) override {
        if (!takes)
            return false;
        last.assign(bytes.begin(), bytes.end());
        waiting_.push_back({now_ns + delay_ns, last});
        return true;
    }
    int in(uint8_t, std::span<std::byte> room) override {
        if (waiting_.empty() || waiting_.front().first > now_ns)
            return -1;
        const std::vector<std::byte> bytes = std::move(waiting_.front().second);
        waiting_.pop_front();
        std::copy(bytes.begin(), bytes.end(), room.begin());
        return static_cast<int>(bytes.size());
    }
    void plugged() override { waiting_.clear(); }

 private:
    std::deque<std::pair<int64_t, std::vector<std::byte>>> waiting_;
};

struct Bench {
    VirtualClock clock;
    Echo peer;
    FakeTransport transport{peer, clock};
    Transfer& out = transport.transfer(0);
    Transfer& in = transport.transfer(1);
    Bench() {
        out.endpoint = 0x02;
        out.size = 2;
        out.bytes[0] = std::byte{7};
        out.bytes[1] = std::byte{9};
        in.endpoint = 0x81;
        in.size = 64;
    }
};

TEST(FakeTransport, WhatGoesOutComesBackAtItsTime) {
    Bench b;
    b.transport.submit(b.in);
    b.transport.submit(b.out);
    EXPECT_TRUE(b.transport.reap(5 * kMs));
    EXPECT_EQ(b.out.status, TransferStatus::done);
    EXPECT_EQ(b.in.status, TransferStatus::pending);
    EXPECT_FALSE(b.transport.reap(0)); // does not wait
    EXPECT_EQ(b.clock.now_ns(), 0);
    EXPECT_TRUE(b.transport.reap(5 * kMs));
    EXPECT_EQ(b.clock.now_ns(), kMs);
    EXPECT_EQ(b.in.moved, 2u);
    EXPECT_EQ(b.in.bytes[1], std::byte{9});
    EXPECT_FALSE(b.transport.reap(5 * kMs));
    EXPECT_EQ(b.clock.now_ns(), 5 * kMs);
}

TEST(FakeTransport, TransfersEndInEveryWay) {
    Bench b;
    EXPECT_EQ(run_transfer(b.transport, b.in, 3 * kMs), TransferStatus::timed_out);
    EXPECT_LE(b.clock.now_ns(), 4 * kMs);
    b.in.timeout_ns = kMs; // the transfer's own
    EXPECT_EQ(run_transfer(b.transport, b.in, 30 * kMs), TransferStatus::timed_out);
    EXPECT_LE(b.clock.now_ns(), 6 * kMs);
    b.in.timeout_ns = 0;
    b.transport.submit(b.in);
    b.transport.cancel(b.in);
    b.transport.reap(0);
    EXPECT_EQ(b.in.status, TransferStatus::cancelled);
    b.peer.refuses = true;
    Transfer& control = b.transport.transfer(2);
    control.kind = TransferKind::control;
    EXPECT_EQ(run_transfer(b.transport, control, kMs), TransferStatus::stalled);
    b.transport.set_fault([](Transfer& t, int64_t) { t.status = TransferStatus::overflowed; });
    EXPECT_EQ(run_transfer(b.transport, b.out, kMs), TransferStatus::overflowed);
    EXPECT_TRUE(b.peer.last.empty());
    b.transport.set_fault(nullptr);
    b.transport.submit(b.in);
    b.transport.unplug();
    EXPECT_TRUE(b.transport.reap(0));
    EXPECT_EQ(b.in.status, TransferStatus::gone);
    b.transport.submit(b.out);
    EXPECT_EQ(b.out.status, TransferStatus::gone);
    EXPECT_TRUE(b.transport.gone());
}

TEST(FakeTransport, AHaltGoesOutAfterWhatWasSubmittedBefore) {
    Bench b;
    EXPECT_FALSE(b.transport.halt()); // nothing prepared
    const std::byte stop[] = {std::byte{0}};
    ASSERT_TRUE(b.transport.prepare_halt(0x02, stop));
    b.transport.submit(b.out);
    EXPECT_TRUE(b.transport.halt());
    b.transport.reap(0);
    EXPECT_EQ(b.peer.last, std::vector<std::byte>{std::byte{0}});
}

} // namespace
} // namespace palpate::haptics
