#pragma once

#include <memory>
#include <string>
#include <vector>

#include "haptics/device/transport/plugged.h"
#include "haptics/device/transport/transport.h"

// USB devices by libusb (docs/decisions/15-usb-and-hid-libraries.md).
namespace palpate::haptics {

// Why this build knows no USB devices, in one sentence; null: it does.
const char* usb_refusal() noexcept;

// In the order of their nodes; those without permission too. Nothing is opened.
std::vector<Plugged> plugged_usb();

// The device at `node`, one interface of which is claimed. Refused, with a sentence that says why:
// no permission, unplugged, another program or driver holds the interface, or this build has no
// libusb. Events of the library are handled within reap(), in the caller's thread. halt() goes past
// the library (raw_halt.h).
Result<std::unique_ptr<Transport>> open_usb(const std::string& node, int interface);

} // namespace palpate::haptics
