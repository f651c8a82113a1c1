#pragma once

#include <cstdint>
#include <string>

// A device that the system knows.
namespace palpate::haptics {

struct Plugged {
    uint16_t vendor = 0, product = 0;
    std::string node; // /dev/bus/usb/001/004, /dev/hidraw0

    // Empty: its node can be opened to read and write. Else one sentence: why not, and what helps.
    std::string refusal;
};

// The `refusal` for a node, which is not opened.
std::string refusal_of_node(const std::string& node);
// The same sentence for a node that open(2) refused with the error number `error`.
std::string refusal_of_node(const std::string& node, int error);

} // namespace palpate::haptics
