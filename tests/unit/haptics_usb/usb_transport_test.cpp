#include "haptics/device/transport/usb_transport.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <mutex>

#include "haptics/device/falcon/codec.h"
#include "haptics/device/falcon/falcon.h"
#include "haptics/device/registry.h"
#include "haptics/device/transport/plugged.h"

// The transport of USB on a kernel that umockdev imitates: sysfs, the device's node, and its
// requests, which a thread of umockdev's answers in this process.
namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kMs = 1'000'000;
constexpr const char* kNode = "/dev/bus/usb/001/004";
constexpr const char* kDevice =
    "P: /devices/pci0000:00/0000:00:14.0/usb1/1-4\n"
    "N: bus/usb/001/004\n"
    "E: DEVNAME=/dev/bus/usb/001/004\n"
    "E: DEVTYPE=usb_device\n"
    "E: SUBSYSTEM=usb\n"
    "A: busnum=1\\n\n"
    "A: devnum=4\\n\n"
    "A: idVendor=0403\\n\n"
    "A: idProduct=cb48\\n\n"
    "A: product=FALCON HAPTIC\\n\n"
    "A: serial=TEST1\\n\n";

// Answers as a Falcon whose firmware runs.
class Kernel {
 public:
    std::atomic<int> submit_error = 0, claim_error = 0;
    std::atomic<bool> unplugged = false, is_silent = false;
    std::atomic<uint64_t> controls = 0, commands = 0;
    std::atomic<int> last_motor = 0;

    void answer(UMockdevIoctlClient* client) {
        const std::lock_guard lock(mutex_);
        void* const argument =
            *reinterpret_cast<void**>(umockdev_ioctl_client_get_arg(client)->data);
        const auto end = [&](int error) {
            umockdev_ioctl_client_complete(client, error ? -1 : 0, error);
        };
        if (unplugged)
            return end(ENODEV);
        switch (umockdev_ioctl_client_get_request(client)) {
            case USBDEVFS_CLAIMINTERFACE: // requests of a node that was closed are forgotten
                done_.clear();
                reads_.clear();
                line_.clear();
                return end(claim_error);
            case USBDEVFS_RELEASEINTERFACE:
                return end(0);
            case USBDEVFS_GETDRIVER:
                return end(ENODATA);
            case USBDEVFS_SUBMITURB:
                if (submit_error)
                    return end(submit_error);
                submit(static_cast<usbdevfs_urb*>(argument));
                return end(0);
            case USBDEVFS_REAPURBNDELAY:
                if (done_.empty())
                    return end(EAGAIN);
                *static_cast<usbdevfs_urb**>(argument) = done_.front();
                done_.pop_front();
                return end(0);
            case USBDEVFS_DISCARDURB: {
                const auto at = std::find(reads_.begin(), reads_.end(), argument);
                if (at == reads_.end())
                    return end(EINVAL);
                (*at)->status = -ENOENT;
                done_.push_back(*at);
                reads_.erase(at);
                return end(0);
            }
            default:
                return end(ENOTTY);
        }
    }

 private:
    void submit(usbdevfs_urb* urb) {
        urb->status = 0;
        urb->actual_length = urb->buffer_length;
        if (urb->type == USBDEVFS_URB_TYPE_CONTROL) {
            ++controls;
            urb->actual_length = urb->buffer_length - 8;
            done_.push_back(urb);
        } else if (urb->endpoint & 0x80) {
            reads_.push_back(urb);
        } else {
            const auto* bytes = static_cast<const std::byte*>(urb->buffer);
            for (int i = 0; i < urb->buffer_length; ++i)
                if (falcon::Packet packet; framer_.add(bytes[i], packet)) {
                    falcon::Command command;
                    if (!falcon::decode(packet, command) || is_silent)
                        continue;
                    ++commands;
                    last_motor = command.motors[0];
                    const falcon::Packet state =
                        falcon::encode(falcon::State{{100, 200, 300}, 5, 7});
                    line_.insert(line_.end(), state.begin(), state.end());
                }
            done_.push_back(urb);
        }
        while (!reads_.empty() && !line_.empty()) { // with the bridge's two status bytes
            usbdevfs_urb* const read = reads_.front();
            reads_.pop_front();
            auto* bytes = static_cast<std::byte*>(read->buffer);
            bytes[0] = std::byte{1};
            bytes[1] = std::byte{0x60};
            const size_t count = std::min<size_t>(line_.size(), 62);
            std::copy_n(line_.begin(), count, bytes + 2);
            line_.erase(line_.begin(), line_.begin() + static_cast<long>(count));
            read->actual_length = static_cast<int>(count + 2);
            read->status = 0;
            done_.push_back(read);
        }
    }

    std::mutex mutex_;
    std::deque<usbdevfs_urb*> done_, reads_;
    std::deque<std::byte> line_;
    falcon::Framer framer_;
};

gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer kernel) {
    static_cast<Kernel*>(kernel)->answer(client);
    return TRUE;
}

class UsbKernel : public ::testing::Test {
 protected:
    void SetUp() override {
        bed_ = umockdev_testbed_new();
        GError* error = nullptr;
        ASSERT_TRUE(umockdev_testbed_add_from_string(bed_, kDevice, &error))
            << (error ? error->message : "");
        handler_ = umockdev_ioctl_base_new();
        g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_ioctl), &kernel_);
        ASSERT_TRUE(umockdev_testbed_attach_ioctl(bed_, kNode, handler_, &error))
            << (error ? error->message : "");
    }
    void TearDown() override {
        umockdev_testbed_detach_ioctl(bed_, kNode, nullptr);
        g_object_unref(handler_);
        g_object_unref(bed_);
    }

    Kernel kernel_;
    UMockdevTestbed* bed_ = nullptr;
    UMockdevIoctlBase* handler_ = nullptr;
};

TEST_F(UsbKernel, ListsWhatIsPluggedIn) {
    const std::vector<Plugged> all = plugged_usb();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].vendor, 0x0403);
    EXPECT_EQ(all[0].product, 0xCB48);
    EXPECT_EQ(all[0].name, "FALCON HAPTIC");
    EXPECT_EQ(all[0].serial, "TEST1");
    EXPECT_EQ(all[0].node, kNode);
    EXPECT_EQ(all[0].refusal, "");
    const Result<DeviceEntry> entry = find_device("novint-falcon");
    ASSERT_TRUE(entry);
    EXPECT_EQ(entry->node, kNode);
}

TEST_F(UsbKernel, AFalconAnswersTenThousandPackets) {
    Result<std::unique_ptr<HapticDevice>> device = open_device(*find_device("novint-falcon"), {});
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_GE(kernel_.controls, 7u);
    DeviceSample sample;
    int fresh = 0;
    const uint64_t before = kernel_.commands;
    for (int i = 0; i < 10'000; ++i) {
        (*device)->write(monotonic_ns(), {{0, 0, 1}});
        if (!(*device)->wait(monotonic_ns() + 1000 * kMs))
            break;
        fresh += (*device)->read(monotonic_ns(), sample) == DeviceStatus::ok;
    }
    EXPECT_EQ(fresh, 10'000);
    EXPECT_GE(kernel_.commands - before, 10'000u);
    EXPECT_NE(kernel_.last_motor, 0);
    EXPECT_EQ(sample.buttons, 5u);
    device->reset();
    EXPECT_EQ(kernel_.last_motor, 0); // the last command is without force
}

TEST_F(UsbKernel, UnpluggedItIsGoneAtOnceAndBackAgain) {
    const DeviceEntry entry = *find_device("novint-falcon");
    std::unique_ptr<HapticDevice> device = std::move(open_device(entry, {}).value());
    DeviceSample sample;
    device->write(monotonic_ns(), {});
    EXPECT_TRUE(device->wait(monotonic_ns() + 1000 * kMs));
    kernel_.unplugged = true;
    const int64_t began_ns = monotonic_ns();
    device->read(monotonic_ns(), sample); // may still give what had come
    EXPECT_EQ(device->read(monotonic_ns(), sample), DeviceStatus::gone);
    EXPECT_EQ(device->write(monotonic_ns(), {}), DeviceStatus::gone);
    EXPECT_FALSE(device->wait(monotonic_ns() + 1000 * kMs));
    device->halt(0);
    device.reset();
    EXPECT_LT(monotonic_ns() - began_ns, 1000 * kMs);
    kernel_.unplugged = false;
    EXPECT_TRUE(open_device(entry, {}));
}

TEST_F(UsbKernel, WhyItCannotBeOpenedIsSaid) {
    const DeviceEntry entry = *find_device("novint-falcon");
    const auto why = [&] {
        const Result<std::unique_ptr<HapticDevice>> device = open_device(entry, {});
        return device ? std::string() : device.error().message;
    };
    kernel_.claim_error = EBUSY;
    EXPECT_THAT(why(), HasSubstr("another program uses it"));
    kernel_.claim_error = 0;
    kernel_.submit_error = EPERM;
    EXPECT_THAT(why(), HasSubstr("refused by the system"));
    kernel_.submit_error = 0;
    kernel_.is_silent = true;
    EXPECT_THAT(why(), HasSubstr("no firmware is loaded"));
    kernel_.is_silent = false;
    DeviceEntry elsewhere = entry;
    elsewhere.node = "/dev/bus/usb/001/099";
    const Result<std::unique_ptr<HapticDevice>> none = open_device(elsewhere, {});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "/dev/bus/usb/001/099: No such file or directory");
    umockdev_testbed_remove_device(bed_, "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-4");
    EXPECT_FALSE(find_device("novint-falcon"));
}

} // namespace
} // namespace palpate::haptics

// umockdev stands between the program and the C library, which takes a preloaded library.
int main(int argc, char** argv) {
    const char* preloaded = std::getenv("LD_PRELOAD");
    if (!preloaded || !std::strstr(preloaded, "umockdev")) {
        ::setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
        ::execv("/proc/self/exe", argv);
        return 1;
    }
    ::testing::InitGoogleMock(&argc, argv);
    return RUN_ALL_TESTS();
}
