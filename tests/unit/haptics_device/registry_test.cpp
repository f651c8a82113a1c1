#include "haptics/device/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace palpate::haptics {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kMs = 1'000'000;

TEST(Devices, EachIsFoundByNameAndByNumberAndOpens) {
    const std::vector<DeviceEntry> all = list_devices();
    std::set<std::string> names;
    for (size_t i = 0; i < all.size(); ++i) {
        SCOPED_TRACE(all[i].name);
        EXPECT_TRUE(names.insert(all[i].name).second);
        if (all[i].driver == std::string_view("recorded") ||
            all[i].driver == std::string_view("adapter") || !all[i].node.empty())
            continue; // needs a file; is plugged in, whoever owns it
        for (const std::string& name : {all[i].name, std::to_string(i)}) {
            const Result<DeviceEntry> found = find_device(name);
            ASSERT_TRUE(found);
            EXPECT_EQ(found->name, all[i].name);
            Result<std::unique_ptr<HapticDevice>> device = open_device(*found, {});
            ASSERT_TRUE(device);
            EXPECT_EQ((*device)->capabilities().name, all[i].capabilities.name);
            DeviceSample sample;
            EXPECT_EQ((*device)->read(0, sample), DeviceStatus::ok);
        }
    }
    // Every preset is a device.
    for (const DevicePreset& preset : device_presets())
        EXPECT_TRUE(names.contains(preset.name)) << preset.name;
}

TEST(Devices, WhatIsNoDeviceIsRefusedByName) {
    const std::string beyond = std::to_string(list_devices().size());
    for (const std::string& name : {std::string(""), std::string("harp"), beyond, std::string("-1"),
                                    std::string("0x"), std::string("1 "), std::string(":")})
        EXPECT_THAT(find_device(name).error().message, HasSubstr("found '" + name + "'"));
    EXPECT_THAT(find_device("falcon:3").error().message,
                HasSubstr("expected the device falcon, found 'falcon:3'"));
    EXPECT_THAT(find_device("adapter").error().message,
                HasSubstr("expected the device adapter:LIBRARY"));
    for (const char* name : {"recorded", "recorded:"})
        EXPECT_THAT(find_device(name).error().message,
                    HasSubstr("expected the device recorded:FILE"));
    for (const char* name : {"novint-falcon", "spacemouse-7", "polhem"})
        if (const Result<DeviceEntry> found = find_device(name); !found) { // whoever owns one
            EXPECT_THAT(found.error().message, HasSubstr(std::string(name) + ": expected a "));
            EXPECT_THAT(found.error().message, HasSubstr("plugged in, found none"));
        }
    const Result<DeviceEntry> file = find_device("recorded:a:b.log");
    ASSERT_TRUE(file);
    EXPECT_EQ(file->argument, "a:b.log");
    EXPECT_THAT(open_device(*file, {}).error().message, HasSubstr("a:b.log"));
}

TEST(Devices, ASimulatedOneThatNeedsHomingSaysNothingBeforeIt) {
    DevicePreset preset = *find_device_preset("ideal");
    SimulatedDevice ready(preset, {}, HandPath({HandPose{}}), Workspace({0, 0, 0}, 1.0));
    EXPECT_FALSE(ready.home());
    preset.capabilities.needs_homing = true;
    SimulatedDevice device(preset, {}, HandPath({HandPose{}}), Workspace({0, 0, 0}, 1.0));
    DeviceSample sample;
    EXPECT_EQ(device.read(0, sample), DeviceStatus::not_homed);
    EXPECT_TRUE(device.home());
    EXPECT_EQ(device.read(kMs, sample), DeviceStatus::ok);
}

TEST(Devices, CalibratingTakesThePlaceOfTheHandleForTheMiddle) {
    const HandPath held({{.tool = {.position_mm = {8, -3, 2}}}});
    SimulatedDevice device(*find_device_preset("ideal"), {}, held, Workspace({0, 0, 0}, 1.0));
    DeviceSample sample;
    device.read(0, sample);
    EXPECT_EQ(sample.position_m, device.true_position_m());
    EXPECT_GT(glm::length(sample.position_m), 8e-3);
    EXPECT_TRUE(device.calibrate());
    device.read(kMs, sample);
    EXPECT_EQ(sample.position_m, glm::dvec3(0));
    EXPECT_EQ(sample.velocity_m_per_s, glm::dvec3(0)); // that was no motion
}

TEST(Devices, SetUpWrongAreRefused) {
    const auto why = [](const DeviceEntry& entry, const DeviceSetup& setup) {
        const Result<std::unique_ptr<HapticDevice>> opened = open_device(entry, setup);
        return opened ? "" : opened.error().message;
    };
    const DeviceEntry ideal = *find_device("ideal");
    EXPECT_EQ(why(ideal, {}), "");
    EXPECT_EQ(why(ideal, {.delay_ticks = 3}),
              "a device: expected a delay of 0 to 2 ticks, found 3");
    for (const double rate_hz : {0.0, -1.0, double(NAN), 1e7})
        EXPECT_THAT(why(ideal, {.rate_hz = rate_hz}), HasSubstr("expected a rate"));
    EXPECT_THAT(why({.name = "ideal", .driver = "none"}, {}), HasSubstr("of the driver 'none'"));
    EXPECT_THAT(why({.name = "another", .driver = ideal.driver}, {}), HasSubstr("found 'another'"));
}

} // namespace
} // namespace palpate::haptics
