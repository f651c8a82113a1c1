#include "haptics/device/adapter/adapter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "haptics/device/registry.h"

namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kMs = 1'000'000;

class Adapter : public ::testing::Test {
 protected:
    ~Adapter() override { ::unsetenv("EXAMPLE_DEVICE"); }
    static void fault(const char* name) { ::setenv("EXAMPLE_DEVICE", name, 1); }
    static std::string why_not(const std::string& file) {
        const auto device = AdapterDevice::open(file);
        return device ? "" : device.error().message;
    }
};

TEST_F(Adapter, ALibraryIsADeviceByItsName) {
    const Result<DeviceEntry> entry = find_device(std::string("adapter:") + PALPATE_EXAMPLE_DEVICE);
    ASSERT_TRUE(entry) << entry.error().message;
    EXPECT_EQ(entry->node, PALPATE_EXAMPLE_DEVICE); // a person moves it
    Result<std::unique_ptr<HapticDevice>> opened = open_device(*entry, {});
    ASSERT_TRUE(opened) << opened.error().message;
    HapticDevice& device = **opened;
    EXPECT_EQ(device.capabilities().name, "example");
    EXPECT_EQ(device.capabilities().max_force_n, 4.0);
    EXPECT_EQ(device.capabilities().buttons, 2u);
    DeviceSample sample;
    EXPECT_EQ(device.read(kMs, sample), DeviceStatus::ok);
    EXPECT_EQ(sample.position_m, glm::dvec3(0.0));
    // It holds forces to its limit, and keeps their direction.
    EXPECT_EQ(device.write(kMs, {.force_n = {0, 30, 40}}), DeviceStatus::ok);
    EXPECT_EQ(device.read(2 * kMs, sample), DeviceStatus::ok);
    EXPECT_NEAR(sample.position_m.y, 1e-3 * 4.0 * 0.6, 1e-12);
    EXPECT_NEAR(sample.position_m.z, 1e-3 * 4.0 * 0.8, 1e-12);
    EXPECT_NEAR(sample.velocity_m_per_s.y, 2.4, 1e-9);
    EXPECT_EQ(sample.buttons, 1u);
    device.halt(0);
    device.read(3 * kMs, sample);
    EXPECT_NEAR(sample.position_m.y, 0.9 * 2.4e-3, 1e-12);
    device.write(3 * kMs, {.force_n = {NAN, 1, 0}});
    device.read(4 * kMs, sample);
    EXPECT_NEAR(sample.position_m.y, 0.81 * 2.4e-3, 1e-12);
}

TEST_F(Adapter, WhatALibraryCannotIsSaid) {
    EXPECT_THAT(why_not("none.so"), HasSubstr("none.so: expected a shared library with a device"));
    EXPECT_THAT(why_not("/proc/self/exe"), HasSubstr("expected"));
    // A library without the entry.
    EXPECT_THAT(why_not("/lib/x86_64-linux-gnu/libm.so.6"), HasSubstr("expected"));
    fault("absent");
    EXPECT_THAT(why_not(PALPATE_EXAMPLE_DEVICE), HasSubstr("no example device is plugged in"));
    fault("still");
    EXPECT_THAT(why_not(PALPATE_EXAMPLE_DEVICE), HasSubstr("a rate above 0"));
}

TEST_F(Adapter, WhatALibrarySaysWrongIsNoSample) {
    const auto device = AdapterDevice::open(PALPATE_EXAMPLE_DEVICE);
    ASSERT_TRUE(device);
    DeviceSample sample;
    EXPECT_EQ((*device)->read(kMs, sample), DeviceStatus::ok);
    fault("nan");
    EXPECT_EQ((*device)->read(2 * kMs, sample), DeviceStatus::stale);
    EXPECT_TRUE(std::isfinite(sample.position_m.y));
    fault("gone");
    EXPECT_EQ((*device)->read(3 * kMs, sample), DeviceStatus::gone);
}

} // namespace
} // namespace palpate::haptics
