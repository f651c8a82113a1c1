#include "haptics/device/transport/usb.h"

// In place of usb.cpp where libusb was not there when Palpate was built.
namespace palpate::haptics {

const char* usb_refusal() noexcept {
    return "Palpate was built without libusb (libusb-1.0-0-dev)";
}

std::vector<Plugged> plugged_usb() {
    return {};
}

Result<std::unique_ptr<Transport>> open_usb(const std::string& node, int) {
    return fail("{}: {}", node, usb_refusal());
}

} // namespace palpate::haptics
