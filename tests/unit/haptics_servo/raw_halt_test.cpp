#include "haptics/core/raw_halt.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "haptics/servo/crash_stop.h"

// The kernel's end of usbfs: this program's own ioctl() stands in for it.
namespace {

struct UsbTransfer {
    int fd;
    unsigned long request;
    unsigned endpoint, timeout_ms;
    std::string bytes;
};
std::vector<UsbTransfer>* usb_transfers = nullptr; // null: there is no such device

} // namespace

extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
    va_list rest;
    va_start(rest, request);
    const auto* const t = va_arg(rest, const usbdevfs_bulktransfer*);
    va_end(rest);
    if (!usb_transfers) {
        errno = ENOTTY;
        return -1;
    }
    usb_transfers->push_back(
        {fd, request, t->ep, t->timeout, std::string(static_cast<const char*>(t->data), t->len)});
    return static_cast<int>(t->len);
}

namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

std::span<const std::byte> bytes_of(const char* text) {
    return std::as_bytes(std::span(text, std::strlen(text)));
}

struct Pipe {
    int ends[2]{-1, -1};
    Pipe() { EXPECT_EQ(pipe2(ends, O_NONBLOCK), 0); }
    ~Pipe() {
        close(ends[0]);
        close_writer();
    }
    void close_writer() {
        if (ends[1] >= 0)
            close(ends[1]);
        ends[1] = -1;
    }
    std::string received() const {
        char bytes[4096];
        const ssize_t got = read(ends[0], bytes, sizeof bytes);
        return {bytes, got > 0 ? static_cast<size_t>(got) : 0u};
    }
};

TEST(RawHalt, SendsItsMessageAsOftenAsAsked) {
    Pipe pipe;
    RawHalt halt;
    EXPECT_FALSE(halt.send()); // nothing is prepared
    ASSERT_TRUE(halt.by_write(pipe.ends[1], bytes_of("<AAAA>")));
    errno = EDOM;
    EXPECT_TRUE(halt.send());
    EXPECT_TRUE(halt.send());
    EXPECT_EQ(errno, EDOM);
    EXPECT_EQ(pipe.received(), "<AAAA><AAAA>");
    // The library closes its descriptor, and its number goes to another file.
    pipe.close_writer();
    Pipe other;
    EXPECT_TRUE(halt.send());
    EXPECT_EQ(pipe.received(), "<AAAA>");
    EXPECT_EQ(other.received(), "");
}

TEST(RawHalt, NeverWaitsForALineThatIsFull) {
    Pipe pipe;
    fcntl(pipe.ends[1], F_SETFL, 0); // as a library has it: writing would wait
    RawHalt halt;
    ASSERT_TRUE(halt.by_write(pipe.ends[1], bytes_of("stop")));
    fcntl(pipe.ends[1], F_SETFL, O_NONBLOCK);
    const std::string page(4096, 'x');
    while (write(pipe.ends[1], page.data(), page.size()) > 0) {
    }
    fcntl(pipe.ends[1], F_SETFL, 0);
    EXPECT_FALSE(halt.send());
}

TEST(RawHalt, ByUsbIsOneTransferToItsEndpoint) {
    Pipe pipe;
    RawHalt halt;
    ASSERT_TRUE(halt.by_usb(pipe.ends[1], 0x02, bytes_of("<AAAAAAAAAAAAAA>")));
    EXPECT_FALSE(halt.send()); // no usbfs
    std::vector<UsbTransfer> sent;
    usb_transfers = &sent;
    EXPECT_TRUE(halt.send());
    usb_transfers = nullptr;
    ASSERT_EQ(sent.size(), 1u);
    EXPECT_EQ(sent[0].request, USBDEVFS_BULK);
    EXPECT_NE(sent[0].fd, pipe.ends[1]);
    EXPECT_EQ(sent[0].endpoint, 2u);
    EXPECT_EQ(sent[0].timeout_ms, 5u);
    EXPECT_EQ(sent[0].bytes, "<AAAAAAAAAAAAAA>");
}

TEST(RawHalt, RefusesWhatItCannotSend) {
    RawHalt halt;
    EXPECT_THAT(halt.by_write(1, {}).error().message, HasSubstr("found 0"));
    EXPECT_THAT(halt.by_write(1, std::vector<std::byte>(66)).error().message,
                HasSubstr("found 66"));
    EXPECT_THAT(halt.by_write(-1, bytes_of("x")).error().message, HasSubstr("Bad file descriptor"));
    EXPECT_FALSE(halt.send());
}

// A driver whose library holds a lock while it writes, and never comes back.
class LockingDevice final : public HapticDevice {
 public:
    explicit LockingDevice(int fd) { EXPECT_TRUE(halt_.by_write(fd, bytes_of("stop;"))); }
    std::atomic<bool> hangs{false};

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    DeviceStatus read(int64_t, DeviceSample&) noexcept override { return DeviceStatus::stale; }
    DeviceStatus write(int64_t, const Wrench&) noexcept override {
        const std::lock_guard lock(library_);
        hangs = true;
        for (;;)
            pause();
    }
    void halt(int64_t) noexcept override { halt_.send(); }

 private:
    DeviceCapabilities capabilities_;
    std::mutex library_;
    RawHalt halt_;
};

// In a process of its own, which dies in `die` while another thread hangs in write().
std::string halted_by(void (*die)()) {
    Pipe pipe;
    const pid_t child = fork();
    if (child == 0) {
        LockingDevice device(pipe.ends[1]);
        const CrashStop stop(device);
        std::thread([&] { device.write(0, {}); }).detach();
        while (!device.hangs)
            std::this_thread::yield();
        die();
        _exit(0);
    }
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    return pipe.received();
}

TEST(RawHalt, AProcessThatDiesHaltsADeviceWhoseLibraryHangsWithItsLock) {
    // Twice: the second takes back what went out between.
    EXPECT_EQ(halted_by([] { std::abort(); }), "stop;stop;");
    EXPECT_EQ(halted_by([] { std::exit(0); }), "stop;stop;");
    EXPECT_EQ(halted_by([] { raise(SIGSEGV); }), "stop;stop;");
    EXPECT_EQ(halted_by([] { _exit(0); }), ""); // no handler: left to the device's watchdog
}

TEST(RawHalt, ManyThreadsMayHaltAtOnce) {
    Pipe pipe;
    RawHalt halt;
    ASSERT_TRUE(halt.by_write(pipe.ends[1], bytes_of("0;")));
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&] {
            for (int k = 0; k < 100; ++k)
                halt.send();
        });
    for (std::thread& thread : threads)
        thread.join();
    const std::string got = pipe.received();
    ASSERT_EQ(got.size(), 800u); // writes of up to 4096 bytes are whole
    for (size_t i = 0; i < got.size(); i += 2)
        ASSERT_EQ(got.substr(i, 2), "0;");
}

} // namespace
} // namespace palpate::haptics
