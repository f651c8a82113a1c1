#include "haptics/device/transport/hid_transport.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "haptics/device/spacemouse/spacemouse.h"

// hidraw's reads and writes on a pair of sockets that keep reports apart as it does.
namespace palpate::haptics {
namespace {

constexpr int64_t kMs = 1'000'000;

struct Pair {
    Fd device;
    std::unique_ptr<HidTransport> transport;
    Pair() {
        int ends[2];
        EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
        device = Fd(ends[0]);
        transport = std::make_unique<HidTransport>(Fd(ends[1]));
    }
    void send(std::initializer_list<uint8_t> report) {
        EXPECT_EQ(::send(device.get(), std::data(report), report.size(), 0),
                  static_cast<ssize_t>(report.size()));
    }
    std::vector<uint8_t> receive() {
        std::vector<uint8_t> report(64);
        const ssize_t came = ::recv(device.get(), report.data(), report.size(), 0);
        report.resize(static_cast<size_t>(std::max<ssize_t>(came, 0)));
        return report;
    }
};

TEST(HidTransport, ReportsComeAndGoWhole) {
    Pair pair;
    Transfer& in = pair.transport->transfer(0);
    in.kind = TransferKind::hid_report;
    in.endpoint = 0x81;
    in.size = 64;
    pair.transport->submit(in);
    EXPECT_FALSE(pair.transport->reap(0));
    EXPECT_EQ(in.status, TransferStatus::pending);
    pair.send({1, 2, 3});
    pair.send({9});
    EXPECT_TRUE(pair.transport->reap(monotonic_ns() + 1000 * kMs));
    EXPECT_EQ(in.moved, 3u);
    EXPECT_EQ(in.bytes[2], std::byte{3});
    EXPECT_EQ(run_transfer(*pair.transport, in, 1000 * kMs), TransferStatus::done);
    EXPECT_EQ(in.moved, 1u);
    EXPECT_EQ(run_transfer(*pair.transport, in, 2 * kMs), TransferStatus::timed_out);
    in.timeout_ns = 2 * kMs;
    EXPECT_EQ(run_transfer(*pair.transport, in, 1000 * kMs), TransferStatus::timed_out);
    Transfer& out = pair.transport->transfer(1);
    out.endpoint = 0x02;
    out.size = 2;
    out.bytes[0] = std::byte{4};
    out.bytes[1] = std::byte{1};
    EXPECT_EQ(run_transfer(*pair.transport, out, kMs), TransferStatus::done);
    EXPECT_EQ(pair.receive(), (std::vector<uint8_t>{4, 1}));
    const std::array stop{std::byte{7}, std::byte{0}};
    ASSERT_TRUE(pair.transport->prepare_halt(0x02, stop));
    EXPECT_TRUE(pair.transport->halt());
    EXPECT_EQ(pair.receive(), (std::vector<uint8_t>{7, 0}));
}

TEST(HidTransport, AnUnpluggedDeviceIsGone) {
    Pair pair;
    SpaceMouseDevice device(std::move(pair.transport), {});
    EXPECT_EQ(pair.receive(), (std::vector<uint8_t>{4, 1}));
    DeviceSample sample;
    pair.send({1, 0x5E, 0x01, 0, 0, 0, 0});
    EXPECT_EQ(device.read(kMs, sample), DeviceStatus::ok);
    EXPECT_EQ(device.read(2 * kMs, sample), DeviceStatus::ok);
    EXPECT_NEAR(sample.position_m.x, 1e-4, 1e-9);
    pair.device = Fd();
    EXPECT_EQ(device.read(3 * kMs, sample), DeviceStatus::gone);
    EXPECT_EQ(device.write(3 * kMs, {}), DeviceStatus::gone);
}

TEST(HidTransport, WhatCannotBeOpenedIsSaid) {
    const Result<std::unique_ptr<HidTransport>> none = HidTransport::open("/dev/hidraw-none");
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "/dev/hidraw-none: No such file or directory");
}

} // namespace
} // namespace palpate::haptics
