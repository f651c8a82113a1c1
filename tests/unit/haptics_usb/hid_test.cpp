#include "haptics/device/transport/hid.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/hidraw.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <umockdev.h>

#include <thread>

#include "engine/base/fd.h"
#include "haptics/device/registry.h"
#include "haptics/device/spacemouse/spacemouse.h"
#include "haptics/device/wooden/wooden.h"
#include "tests/support/with_umockdev.h"
#include "tests/unit/haptics_hands/fake_wooden.h"

// hidapi on a kernel that is imitated. The node is a terminal, whose other end is the device: it
// keeps bytes and their order, and reports apart where one is read before the next is sent.
namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kMs = 1'000'000;
constexpr const char* kNode = "/dev/hidraw0";
constexpr const char* kDevice =
    "/devices/pci0000:00/0000:00:14.0/usb1/1-2/1-2:1.0/0003:256F:C635.0001";
// A multi-axis controller: six axes of -500 .. 500 in report 1, a light in report 4.
constexpr const char* kDescriptor =
    "05010908A10185011633FE26F40109300931093209330934093575109506810285040508094B75089501"
    "9102C0";

class HidTest : public ::testing::Test {
 protected:
    HidTest() : bed_(umockdev_testbed_new()) {
        const std::string parent = std::string("P: ") + kDevice +
                                   "\n"
                                   "E: SUBSYSTEM=hid\n"
                                   "E: DRIVER=hid-generic\n"
                                   "E: HID_ID=0003:0000256F:0000C635\n"
                                   "E: HID_NAME=3Dconnexion SpaceMouse Compact\n"
                                   "E: HID_UNIQ=\n"
                                   "H: report_descriptor=" +
                                   kDescriptor + "\n";
        const std::string node = std::string("P: ") + kDevice +
                                 "/hidraw/hidraw0\n"
                                 "N: hidraw0\n"
                                 "E: DEVNAME=/dev/hidraw0\n"
                                 "E: SUBSYSTEM=hidraw\n"
                                 "L: device=../../../0003:256F:C635.0001\n";
        handler_ = umockdev_ioctl_base_new();
        g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(on_ioctl), this);
        GError* error = nullptr;
        if (!umockdev_testbed_attach_ioctl(bed_, kNode, handler_, &error) ||
            !umockdev_testbed_add_from_string(bed_, parent.c_str(), &error) ||
            !umockdev_testbed_add_from_string(bed_, node.c_str(), &error))
            throw std::runtime_error(error ? error->message : "umockdev");
        device_ = umockdev_testbed_get_dev_fd(bed_, kNode);
    }
    ~HidTest() override {
        umockdev_testbed_detach_ioctl(bed_, kNode, nullptr);
        g_object_unref(handler_);
        g_object_unref(bed_);
    }
    static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer) {
        UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
        const bool is_size = umockdev_ioctl_client_get_request(client) == HIDIOCGRDESCSIZE;
        if (is_size) {
            UMockdevIoctlData* const size =
                umockdev_ioctl_data_resolve(argument, 0, sizeof(int), nullptr);
            *reinterpret_cast<int*>(size->data) = static_cast<int>(std::strlen(kDescriptor) / 2);
            umockdev_ioctl_data_unref(size);
        }
        umockdev_ioctl_client_complete(client, is_size ? 0 : -1, is_size ? 0 : ENOTTY);
        return TRUE;
    }

    // The device's end.
    void send(std::initializer_list<uint8_t> report) {
        EXPECT_EQ(::write(device_, std::data(report), report.size()),
                  static_cast<ssize_t>(report.size()));
    }
    std::vector<uint8_t> receive() {
        std::vector<uint8_t> report(64);
        const ssize_t came = ::read(device_, report.data(), report.size());
        report.resize(static_cast<size_t>(std::max<ssize_t>(came, 0)));
        return report;
    }
    // It vanishes from sysfs and from /dev, and its end of the terminal closes.
    void unplug() {
        const std::string parent = std::string("/sys") + kDevice;
        umockdev_testbed_remove_device(bed_, (parent + "/hidraw/hidraw0").c_str());
        umockdev_testbed_remove_device(bed_, parent.c_str());
        gchar* const root = umockdev_testbed_get_root_dir(bed_);
        ::unlink((std::string(root) + kNode).c_str());
        g_free(root);
        const Fd nothing(::open("/dev/null", O_RDWR)); // the testbed closes the number
        ::dup2(nothing.get(), device_);
    }

    UMockdevTestbed* bed_;
    UMockdevIoctlBase* handler_ = nullptr;
    int device_ = -1;
};

TEST_F(HidTest, ListsWhatIsPluggedIn) {
    const std::vector<Plugged> all = plugged_hid();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].vendor, 0x256F);
    EXPECT_EQ(all[0].product, 0xC635);
    EXPECT_EQ(all[0].node, kNode);
    EXPECT_EQ(all[0].refusal, "");
    const spacemouse::Description six = spacemouse::describe(report_descriptor(kNode));
    EXPECT_TRUE(six.is_six_axis);
    EXPECT_EQ(six.range, 500);
    const Result<DeviceEntry> entry = find_device("spacemouse");
    ASSERT_TRUE(entry);
    EXPECT_EQ(entry->node, kNode);
}

TEST_F(HidTest, TenThousandReportsComeAndGoWhole) {
    Result<std::unique_ptr<Transport>> opened = open_hid(kNode);
    ASSERT_TRUE(opened) << opened.error().message;
    Transport& transport = **opened;
    Transfer& in = transport.transfer(0);
    in.kind = TransferKind::hid_report;
    in.endpoint = 0x81;
    in.size = 64;
    Transfer& out = transport.transfer(1);
    out.kind = TransferKind::hid_report;
    out.endpoint = 0x02;
    out.size = 3;
    transport.submit(in);
    EXPECT_FALSE(transport.reap(0));
    EXPECT_EQ(in.status, TransferStatus::pending);
    for (int i = 0; i < 10'000; ++i) {
        const auto low = static_cast<uint8_t>(i), high = static_cast<uint8_t>(i >> 8);
        out.bytes[0] = std::byte{4};
        out.bytes[1] = std::byte{low};
        out.bytes[2] = std::byte{high};
        ASSERT_EQ(run_transfer(transport, out, kMs), TransferStatus::done);
        ASSERT_EQ(receive(), (std::vector<uint8_t>{4, low, high}));
        send({1, high, low, 7});
        ASSERT_TRUE(transport.reap(monotonic_ns() + 5000 * kMs));
        ASSERT_EQ(in.moved, 4u);
        ASSERT_EQ(in.bytes[1], std::byte{high});
        ASSERT_EQ(in.bytes[2], std::byte{low});
        transport.submit(in);
    }
    transport.cancel(in);
    EXPECT_TRUE(transport.reap(monotonic_ns() + 1000 * kMs));
    EXPECT_EQ(in.status, TransferStatus::cancelled);
    EXPECT_EQ(run_transfer(transport, in, 2 * kMs), TransferStatus::timed_out);
    in.timeout_ns = 2 * kMs;
    EXPECT_EQ(run_transfer(transport, in, 5000 * kMs), TransferStatus::timed_out);
    const std::array stop{std::byte{7}, std::byte{0}};
    ASSERT_TRUE(transport.prepare_halt(0x02, stop));
}

TEST_F(HidTest, AnUnpluggedDeviceIsGone) {
    const DeviceEntry entry = *find_device("spacemouse");
    Result<std::unique_ptr<HapticDevice>> opened = open_device(entry, {});
    ASSERT_TRUE(opened) << opened.error().message;
    HapticDevice& device = **opened;
    EXPECT_EQ(receive(), (std::vector<uint8_t>{4, 1}));
    DeviceSample sample;
    send({1, 0xF4, 0x01, 0, 0, 0, 0});
    EXPECT_EQ(device.read(kMs, sample), DeviceStatus::ok);
    EXPECT_EQ(device.read(2 * kMs, sample), DeviceStatus::ok);
    EXPECT_NEAR(sample.position_m.x, 1e-4, 1e-9);
    unplug();
    const int64_t began_ns = monotonic_ns();
    EXPECT_EQ(device.read(3 * kMs, sample), DeviceStatus::gone);
    EXPECT_EQ(device.write(3 * kMs, {}), DeviceStatus::gone);
    opened->reset();
    EXPECT_LT(monotonic_ns() - began_ns, 1000 * kMs);
    EXPECT_FALSE(find_device("spacemouse"));
    EXPECT_THAT(open_device(entry, {}).error().message, HasSubstr("/dev/hidraw0: No such"));
}

TEST_F(HidTest, WithoutPermissionItIsListedAndSaysWhatHelps) {
    gchar* const root = umockdev_testbed_get_root_dir(bed_);
    ::chmod(root, 0777);
    ::chmod((std::string(root) + "/ioctl" + kNode).c_str(), 0777);
    // The node is a link to a terminal.
    ::chmod((std::string(root) + kNode).c_str(), 0);
    g_free(root);
    const AsNobody nobody;
    const Result<DeviceEntry> entry = find_device("spacemouse");
    ASSERT_TRUE(entry);
    EXPECT_THAT(entry->refusal, HasSubstr("no permission; install Palpate's udev rules"));
    const Result<std::unique_ptr<HapticDevice>> device = open_device(*entry, {});
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().message, entry->refusal);
}

// A model of WoodenHaptics that keeps what passes it, and whose grip moves with the reports.
class Moving final : public FakePeer {
 public:
    FakeWooden model{wooden::kWoodenHaptics};
    std::vector<std::vector<std::byte>> came; // from it

    void advance(int64_t) override {} // no time: its own watchdog sleeps
    bool control(const UsbSetup&, std::span<const std::byte>) override { return false; }
    bool out(uint8_t endpoint, std::span<const std::byte> report) override {
        const double turn = 0.02 * static_cast<double>(model.sent.size());
        model.place_m = 0.03 * glm::dvec3(std::sin(turn), std::cos(turn), std::sin(0.3 * turn));
        return model.out(endpoint, report);
    }
    int in(uint8_t endpoint, std::span<std::byte> room) override {
        const int size = model.in(endpoint, room);
        if (size > 0)
            came.emplace_back(room.begin(), room.begin() + size);
        return size;
    }
    void plugged() override {}
};

// One driver on one model, by hidapi and on the fake: the same reports in the same order both ways.
TEST_F(HidTest, TheSameBytesPassHidapiAndTheFake) {
    constexpr int kReports = 500;
    // Each command is sent when the answer to the one before has been read.
    const auto run = [&](WoodenDevice& device, const std::function<bool()>& pass) {
        std::vector<glm::dvec3> places;
        DeviceSample sample;
        for (int i = 0; i < kReports; ++i) {
            device.write(i * kMs, {{0.002 * i, -0.5, 1.0}});
            while (device.read(i * kMs, sample) != DeviceStatus::ok)
                if (!pass())
                    return places;
            places.push_back(sample.position_m);
        }
        return places;
    };
    Moving faked;
    VirtualClock clock;
    std::unique_ptr<WoodenDevice> by_fake =
        std::move(WoodenDevice::open(std::make_unique<FakeTransport>(faked, clock),
                                     wooden::kWoodenHaptics, 64)
                      .value());
    ASSERT_EQ(faked.model.sent.size(), 1u);
    const std::vector<glm::dvec3> expected = run(*by_fake, [&] {
        clock.sleep_until(clock.now_ns() + kMs);
        return clock.now_ns() < 5000 * kMs;
    });
    ASSERT_EQ(expected.size(), size_t{kReports});

    // The other end of the node: answers what comes until it is closed. A machine that is busy lets
    // the driver ask again while it is opened, so both count from the first command after that.
    Moving plugged;
    std::mutex mutex;
    std::jthread firmware([&](const std::stop_token& stop) {
        std::array<std::byte, 65> report;
        while (!stop.stop_requested()) {
            pollfd ready{.fd = device_, .events = POLLIN, .revents = 0};
            if (::poll(&ready, 1, 5) != 1)
                continue;
            const std::lock_guard lock(mutex);
            const ssize_t size = ::read(device_, report.data(), report.size());
            if (size <= 0 || !plugged.out(0x02, std::span(report).first(size_t(size))))
                continue;
            std::array<std::byte, 64> answer;
            const int count = plugged.in(0x81, answer);
            ASSERT_GT(count, 0);
            EXPECT_EQ(::write(device_, answer.data(), size_t(count)), count);
        }
    });
    Result<std::unique_ptr<Transport>> opened = open_hid(kNode);
    ASSERT_TRUE(opened) << opened.error().message;
    Result<std::unique_ptr<WoodenDevice>> by_hidapi =
        WoodenDevice::open(std::move(*opened), wooden::kWoodenHaptics, 64);
    ASSERT_TRUE(by_hidapi) << by_hidapi.error().message;
    const int64_t until_ns = monotonic_ns() + 60'000 * kMs;
    for (bool is_answered = false; !is_answered;) {
        ASSERT_LT(monotonic_ns(), until_ns);
        const std::lock_guard lock(mutex);
        pollfd unread{.fd = device_, .events = POLLIN, .revents = 0};
        is_answered = ::poll(&unread, 1, 0) == 0;
        if (!is_answered)
            continue;
        DeviceSample sample;
        (*by_hidapi)->read(0, sample); // what is left of the answers
        plugged.model.sent.resize(1);
        plugged.came.resize(1);
    }
    const std::vector<glm::dvec3> places =
        run(**by_hidapi, [&] { return monotonic_ns() < until_ns; });
    firmware.request_stop();
    firmware.join();
    EXPECT_EQ(places, expected);
    EXPECT_EQ(plugged.came, faked.came);
    ASSERT_EQ(plugged.model.sent.size(), faked.model.sent.size());
    for (size_t i = 0; i < faked.model.sent.size(); ++i)
        ASSERT_EQ(plugged.model.sent[i], faked.model.sent[i]) << "report " << i;
    EXPECT_EQ(faked.model.sent.back().size(), 65u);
}

} // namespace
} // namespace palpate::haptics
