#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "haptics/core/device.h"
#include "haptics/core/workspace.h"
#include "haptics/device/hand_path.h"
#include "haptics/device/simulated.h"

// Every device that there is, and how it is opened.
namespace palpate::haptics {

// A device that can be opened now.
struct DeviceEntry {
    std::string name;        // unique among those listed; as --device takes it, without a colon
    std::string argument;    // behind the name and a colon; empty where the driver takes none
    const char* driver = ""; // the name of the driver that opens it
    DeviceCapabilities capabilities;
    std::string node;    // of a device that is plugged in; empty: a program's own
    std::string refusal; // why it cannot be opened now, in one sentence; empty: it can
};

// Settings of a simulated hand, which drivers of real devices ignore; and of theirs.
struct DeviceSetup {
    HandPath path{{HandPose{}}};             // intended positions of the hand, world
    Workspace workspace{glm::dvec3(0), 1.0}; // through which it gets there
    HandModel hand;
    uint32_t delay_ticks = 0; // 0 .. 2
    double rate_hz = 1000.0;  // of the samples of a path that is followed exactly
    int64_t start_ns = 0;     // time 0 of the path, on the clock of the ticks
    std::string firmware;     // file of a Novint Falcon's; empty: it is loaded already
};

// A kind of device. To add one: a pair of files, a test, and a line in the table of registry.cpp.
struct DeviceDriver {
    const char* name;
    const char* purpose;  // one line
    const char* argument; // behind the colon, for people ("FILE"); "" where there is none
    // The devices that are there now, each with all but `argument` and `driver`. A driver that
    // takes an argument lists one.
    std::vector<DeviceEntry> (*list)();
    Result<std::unique_ptr<HapticDevice>> (*open)(const DeviceEntry& entry,
                                                  const DeviceSetup& setup);
    // Why this build or machine has none of its devices, in one sentence; null: it may have.
    const char* refusal = nullptr;
};
std::span<const DeviceDriver> device_drivers();

// In the order of the drivers. The place in the list is the device's number.
std::vector<DeviceEntry> list_devices();
// By name, by number, or as NAME:ARGUMENT.
Result<DeviceEntry> find_device(std::string_view name);
// Opened, in the state it was found in: HapticDevice::home() and calibrate() come next where its
// capabilities say so.
Result<std::unique_ptr<HapticDevice>> open_device(const DeviceEntry& entry,
                                                  const DeviceSetup& setup);

} // namespace palpate::haptics
