#include "haptics/device/transport/usb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "haptics/device/falcon/fake_falcon.h"
#include "haptics/device/falcon/falcon.h"
#include "haptics/device/registry.h"
#include "tests/support/usb_bed.h"

// libusb, the driver on it and the list of devices, on a kernel that is imitated.
namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kMs_ns = 1'000'000;

// Listens to a model: each message to it, and the stream of bytes from it.
class Listener final : public FakePeer {
 public:
    explicit Listener(FakePeer& peer) : peer_(peer) {}
    std::vector<std::string> sent;
    std::string came; // without the bridge's status, which depends on when somebody looks

    void advance(int64_t to_ns) override { peer_.advance(to_ns); }
    bool control(const UsbSetup& setup, std::span<const std::byte> bytes) override {
        sent.push_back(fmt::format("control {:02x} {:02x} {:04x} {:04x}{}", setup.type,
                                   setup.request, setup.value, setup.index, text_of(bytes)));
        return peer_.control(setup, bytes);
    }
    bool out(uint8_t endpoint, std::span<const std::byte> bytes) override {
        if (!peer_.out(endpoint, bytes))
            return false;
        sent.push_back(fmt::format("out {:02x}{}", endpoint, text_of(bytes)));
        return true;
    }
    int in(uint8_t endpoint, std::span<std::byte> room) override {
        const int count = peer_.in(endpoint, room);
        if (count > 2)
            came += text_of(room.subspan(2, static_cast<size_t>(count) - 2));
        return count;
    }
    void plugged() override { peer_.plugged(); }

 private:
    static std::string text_of(std::span<const std::byte> bytes) {
        std::string text;
        for (const std::byte byte : bytes)
            text += fmt::format(" {:02x}", std::to_integer<unsigned>(byte));
        return text;
    }
    FakePeer& peer_;
};

std::vector<std::byte> test_firmware() {
    std::vector<std::byte> image(4999);
    for (size_t i = 0; i < image.size(); ++i)
        image[i] = static_cast<std::byte>(i * 31 + i / 7);
    return image;
}

// A model whose time passes with the requests, 50 us each: as much of it as on the fake.
class UsbTest : public ::testing::Test {
 protected:
    falcon::FakeFalcon model{{}};
    std::atomic<int64_t> now_ns = 0;
    UsbBed bed{model, [this] { return now_ns += FakeTransport::kPoll_ns; }};

    static Result<std::unique_ptr<HapticDevice>> open() {
        PALPATE_TRY(const DeviceEntry entry, find_device("novint-falcon"));
        return open_device(entry, {});
    }
};

// UsbTest takes over 5 s of a processor: each case begins a process on an imitated kernel, and
// packets pass it at their own pace.
TEST_F(UsbTest, ListsWhatIsPluggedIn) {
    const std::vector<Plugged> all = plugged_usb();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].vendor, 0x0403);
    EXPECT_EQ(all[0].product, 0xCB48);
    EXPECT_EQ(all[0].node, UsbBed::kNode);
    EXPECT_EQ(all[0].refusal, "");
    const Result<DeviceEntry> entry = find_device("novint-falcon");
    ASSERT_TRUE(entry);
    EXPECT_EQ(entry->node, UsbBed::kNode);
    bed.remove();
    EXPECT_TRUE(plugged_usb().empty());
    EXPECT_FALSE(find_device("novint-falcon"));
}

TEST_F(UsbTest, AFalconAnswersTenThousandPackets) {
    Result<std::unique_ptr<HapticDevice>> device = open();
    ASSERT_TRUE(device) << device.error().message;
    EXPECT_GE(bed.controls, 7u);
    DeviceSample sample;
    int fresh = 0;
    const uint64_t before = model.commands();
    for (int i = 0; i < 10'000; ++i) {
        (*device)->write(monotonic_ns(), {{0, 0, 1}});
        if (!(*device)->wait(monotonic_ns() + 5000 * kMs_ns))
            break;
        fresh += (*device)->read(monotonic_ns(), sample) == DeviceStatus::ok;
    }
    EXPECT_EQ(fresh, 10'000);
    const auto lock = bed.hold();
    EXPECT_GE(model.commands() - before, 10'000u);
    EXPECT_NE(model.command().motors, (falcon::Counts{}));
}

// This test cannot show that halt() ends it, too: umockdev does not follow a descriptor that
// fcntl(2) duplicates. tests/unit/haptics_servo/raw_halt_test.cpp shows what it sends.
TEST_F(UsbTest, ClosingEndsAllForce) {
    Result<std::unique_ptr<HapticDevice>> device = open();
    ASSERT_TRUE(device) << device.error().message;
    DeviceSample sample;
    for (int i = 0; i < 5; ++i) {
        (*device)->write(monotonic_ns(), {{0, 0, 1}});
        (*device)->wait(monotonic_ns() + 1000 * kMs_ns);
        (*device)->read(monotonic_ns(), sample);
    }
    {
        const auto lock = bed.hold();
        EXPECT_NE(model.command().motors, (falcon::Counts{}));
    }
    device->reset();
    const auto lock = bed.hold();
    model.advance(now_ns += 5 * kMs_ns); // what is on the line arrives
    EXPECT_EQ(model.command().motors, (falcon::Counts{}));
}

TEST_F(UsbTest, UnpluggedItIsGoneAtOnceAndBackAgain) {
    std::unique_ptr<HapticDevice> device = std::move(open().value());
    DeviceSample sample;
    device->write(monotonic_ns(), {});
    EXPECT_TRUE(device->wait(monotonic_ns() + 1000 * kMs_ns));
    bed.is_unplugged = true;
    const int64_t began_ns = monotonic_ns();
    device->read(monotonic_ns(), sample); // may still give what had come
    device->write(monotonic_ns(), {});    // a request finds that it is gone
    EXPECT_EQ(device->read(monotonic_ns(), sample), DeviceStatus::gone);
    EXPECT_EQ(device->write(monotonic_ns(), {}), DeviceStatus::gone);
    EXPECT_FALSE(device->wait(monotonic_ns() + 1000 * kMs_ns));
    device->halt(0);
    device.reset();
    EXPECT_LT(monotonic_ns() - began_ns, 1000 * kMs_ns);
    bed.is_unplugged = false;
    EXPECT_TRUE(open());
}

TEST_F(UsbTest, PluggedInAgainItIsFoundAtAnotherAddress) {
    std::unique_ptr<HapticDevice> device = std::move(open().value());
    bed.is_unplugged = true;
    DeviceSample sample;
    device->write(monotonic_ns(), {});
    device->read(monotonic_ns(), sample);
    EXPECT_EQ(device->read(monotonic_ns(), sample), DeviceStatus::gone);
    device.reset();
    bed.remove();
    EXPECT_FALSE(find_device("novint-falcon"));
    bed.plug(7);
    bed.is_unplugged = false;
    const Result<DeviceEntry> entry = find_device("novint-falcon");
    ASSERT_TRUE(entry);
    EXPECT_EQ(entry->node, "/dev/bus/usb/001/007");
    const Result<std::unique_ptr<HapticDevice>> again = open();
    ASSERT_TRUE(again) << again.error().message;
    (*again)->write(monotonic_ns(), {});
    EXPECT_TRUE((*again)->wait(monotonic_ns() + 5000 * kMs_ns));
    EXPECT_EQ((*again)->read(monotonic_ns(), sample), DeviceStatus::ok);
}

TEST_F(UsbTest, WhyItCannotBeOpenedIsSaid) {
    const DeviceEntry entry = *find_device("novint-falcon");
    const auto why = [&] {
        const Result<std::unique_ptr<HapticDevice>> device = open_device(entry, {});
        return device ? std::string() : device.error().message;
    };
    bed.claim_error = EBUSY;
    EXPECT_THAT(why(), HasSubstr("another program uses it"));
    bed.claim_error = 0;
    bed.submit_error = EPERM;
    EXPECT_THAT(why(), HasSubstr("refused by the system"));
    bed.submit_error = 0;
    {
        const auto lock = bed.hold();
        model.silent = true;
    }
    EXPECT_THAT(why(), HasSubstr("no firmware is loaded"));
    DeviceEntry elsewhere = entry;
    elsewhere.node = "/dev/bus/usb/001/099";
    const Result<std::unique_ptr<HapticDevice>> none = open_device(elsewhere, {});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "/dev/bus/usb/001/099: No such file or directory");
}

TEST_F(UsbTest, WithoutPermissionItIsListedAndSaysWhatHelps) {
    bed.forbid();
    const AsNobody nobody;
    const Result<DeviceEntry> entry = find_device("novint-falcon");
    ASSERT_TRUE(entry);
    EXPECT_THAT(entry->refusal, HasSubstr("no permission; install Palpate's udev rules"));
    const Result<std::unique_ptr<HapticDevice>> device = open_device(*entry, {});
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().message, entry->refusal);
}

// One driver on one model, by libusb and on the fake: the same messages in the same order, from the
// boot program to force. The grip stands still, because time passes differently for the two.
TEST(Usb, TheSameBytesPassLibusbAndTheFake) {
    const falcon::FakeFalconSetup setup{
        .firmware = test_firmware(), .is_loaded = false, .homing_packets = 100};
    const auto run = [](std::unique_ptr<Transport> transport) {
        Clock& clock = transport->clock();
        Result<std::unique_ptr<FalconDevice>> device =
            FalconDevice::open(std::move(transport), test_firmware());
        ASSERT_TRUE(device) << device.error().message;
        EXPECT_EQ((*device)->started(), falcon::Started::loaded);
        ASSERT_TRUE((*device)->home());
        DeviceSample sample;
        (*device)->read(clock.now_ns(), sample); // what answered while it was opened
        int homed = 0;
        for (int i = 0; i < 300; ++i) {
            (*device)->write(clock.now_ns(), {{0, 0, 0.01 * i}});
            ASSERT_TRUE((*device)->wait(clock.now_ns() + 5000 * kMs_ns));
            homed += (*device)->read(clock.now_ns(), sample) == DeviceStatus::ok;
        }
        EXPECT_GT(homed, 190);
    };
    falcon::FakeFalcon faked(setup), plugged(setup);
    faked.encoders_stuck = plugged.encoders_stuck = true;
    Listener by_fake(faked), by_libusb(plugged);
    VirtualClock clock;
    run(std::make_unique<FakeTransport>(by_fake, clock));
    std::atomic<int64_t> now_ns = 0;
    UsbBed bed(by_libusb, [&] { return now_ns += kMs_ns; }); // fast, so that no patience ends
    Result<std::unique_ptr<Transport>> transport = open_usb(UsbBed::kNode, 0);
    ASSERT_TRUE(transport) << transport.error().message;
    run(std::move(*transport));
    EXPECT_GT(by_fake.sent.size(), 400u);
    ASSERT_EQ(by_fake.sent.size(), by_libusb.sent.size());
    for (size_t i = 0; i < by_fake.sent.size(); ++i)
        ASSERT_EQ(by_fake.sent[i], by_libusb.sent[i]) << "message " << i;
    // Nobody waits for the answer to the last command.
    const size_t read = std::min(by_fake.came.size(), by_libusb.came.size());
    EXPECT_GT(read, 3u * (4999 + 300 * 16));
    EXPECT_EQ(by_fake.came.compare(0, read, by_libusb.came, 0, read), 0);
}

} // namespace
} // namespace palpate::haptics
