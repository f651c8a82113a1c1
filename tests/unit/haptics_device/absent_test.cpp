#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "haptics/device/registry.h"
#include "haptics/device/transport/hid.h"
#include "haptics/device/transport/usb.h"

// This program is linked as a build is that found neither libusb nor hidapi.
namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

TEST(AbsentLibraries, AreNamedAndHaveNoDevices) {
    EXPECT_THAT(usb_refusal(), HasSubstr("built without libusb"));
    EXPECT_THAT(hid_refusal(), HasSubstr("built without hidapi"));
    EXPECT_TRUE(plugged_usb().empty());
    EXPECT_TRUE(plugged_hid().empty());
    EXPECT_THAT(open_usb("/dev/bus/usb/001/001", 0).error().message, HasSubstr("without libusb"));
    EXPECT_THAT(open_hid("/dev/hidraw0").error().message, HasSubstr("without hidapi"));
    size_t refused = 0;
    for (const DeviceDriver& driver : device_drivers())
        if (driver.refusal) {
            ++refused;
            EXPECT_TRUE(driver.list().empty()) << driver.name;
        }
    EXPECT_GE(refused, 2u);
    EXPECT_TRUE(find_device("falcon")); // the simulated one
}

} // namespace
} // namespace palpate::haptics
