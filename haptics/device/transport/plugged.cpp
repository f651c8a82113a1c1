#include "haptics/device/transport/plugged.h"

#include <fmt/format.h>
#include <string.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>

namespace palpate::haptics {

namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
}

// 0 where there is none.
unsigned number(std::string_view text, int base) {
    unsigned value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value, base);
    return value;
}

std::string refusal_of(const std::string& node) {
    if (::access(node.c_str(), R_OK | W_OK) == 0)
        return {};
    if (errno == EACCES || errno == EPERM)
        return fmt::format(
            "{}: no permission; install Palpate's udev rules (70-palpate.rules) and plug the "
            "device "
            "in again",
            node);
    return fmt::format("{}: {}", node, ::strerror(errno));
}

std::vector<fs::path> entries_of(const char* folder) {
    std::vector<fs::path> entries;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        entries.push_back(at->path());
    std::sort(entries.begin(), entries.end()); // one order whatever the system's
    return entries;
}

} // namespace

std::vector<Plugged> plugged_usb() {
    std::vector<Plugged> all;
    for (const fs::path& device : entries_of("/sys/bus/usb/devices")) {
        Plugged found{
            .vendor = static_cast<uint16_t>(number(first_line(device / "idVendor"), 16)),
            .product = static_cast<uint16_t>(number(first_line(device / "idProduct"), 16)),
            .name = first_line(device / "product"),
            .serial = first_line(device / "serial")};
        const unsigned bus = number(first_line(device / "busnum"), 10),
                       address = number(first_line(device / "devnum"), 10);
        if (found.vendor == 0 || bus == 0 || address == 0)
            continue; // an interface, or a device that was unplugged meanwhile
        found.node = fmt::format("/dev/bus/usb/{:03}/{:03}", bus, address);
        found.refusal = refusal_of(found.node);
        all.push_back(std::move(found));
    }
    return all;
}

std::vector<Plugged> plugged_hid() {
    std::vector<Plugged> all;
    for (const fs::path& node : entries_of("/sys/class/hidraw")) {
        Plugged found{.node = "/dev/" + node.filename().string(),
                      .report_descriptor = node / "device" / "report_descriptor"};
        std::ifstream file(node / "device" / "uevent");
        for (std::string line; std::getline(file, line);) {
            const std::string_view text(line);
            if (text.starts_with("HID_NAME=")) {
                found.name = text.substr(9);
            } else if (text.starts_with("HID_UNIQ=")) {
                found.serial = text.substr(9);
            } else if (text.starts_with("HID_ID=") && text.size() >= 7 + 4 + 1 + 8 + 1 + 8) {
                // HID_ID=0003:0000256F:0000C635
                found.vendor = static_cast<uint16_t>(number(text.substr(12, 8), 16));
                found.product = static_cast<uint16_t>(number(text.substr(21, 8), 16));
            }
        }
        if (found.vendor == 0)
            continue;
        found.refusal = refusal_of(found.node);
        all.push_back(std::move(found));
    }
    return all;
}

} // namespace palpate::haptics
