#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

// Devices that the kernel knows, as sysfs tells them. Nothing is opened, so that a device without
// permission is listed too.
namespace palpate::haptics {

struct Plugged {
    uint16_t vendor = 0, product = 0;
    std::string name;                        // that the device gives itself; may be empty
    std::string serial;                      // may be empty
    std::string node;                        // /dev/bus/usb/001/004, /dev/hidraw0
    std::filesystem::path report_descriptor; // of HID devices

    // Empty: its node can be opened to read and write. Else one sentence: why not, and what helps.
    std::string refusal;
};

std::vector<Plugged> plugged_usb();
std::vector<Plugged> plugged_hid();

} // namespace palpate::haptics
