#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "haptics/device/transport/plugged.h"
#include "haptics/device/transport/transport.h"

// HID devices by hidapi on the kernel's hidraw, beside which the kernel's own drivers and other
// programs go on working (docs/decisions/15-usb-and-hid-libraries.md).
namespace palpate::haptics {

// Why this build knows no HID devices, in one sentence; null: it does.
const char* hid_refusal() noexcept;

// In the order of their nodes; those without permission too. Nothing is opened.
std::vector<Plugged> plugged_hid();

// The report descriptor of a hidraw node, which any person may read; empty where there is none.
std::vector<std::byte> report_descriptor(const std::string& node);

// The device at `node`. Transfers are reports. Outgoing ones, whose first byte is the report id,
// are written within submit(); of incoming ones at most one is in flight, and reap() waits for it
// in whole milliseconds. Refused, with a sentence that says why: no permission, unplugged, or this
// build has no hidapi. halt() goes past the library (raw_halt.h).
Result<std::unique_ptr<Transport>> open_hid(const std::string& node);

} // namespace palpate::haptics
