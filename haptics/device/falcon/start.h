#pragma once

#include <filesystem>
#include <stop_token>
#include <vector>

#include "haptics/device/transport/transport.h"

// From a Falcon as it was plugged in to one whose run-time firmware answers. These functions wait;
// they are for whoever opens a device, not for ticks.
namespace palpate::haptics::falcon {

// The maker's firmware, which only owners have: Palpate neither contains nor fetches it. Refused:
// sizes that no known image has, and files that are text.
constexpr size_t kLeastFirmware = 4096, kMostFirmware = 32768; // bytes; known ones: 7 to 9 thousand
Result<std::vector<std::byte>> load_firmware(const std::filesystem::path& path);

enum class Started : uint8_t { was_running, loaded };

// Sets the bridge up. Where no firmware answers, loads `firmware` (about 0.6 s), every byte of
// which comes back and is compared; the device keeps it until its power goes. An error within 3 s:
// no firmware answers and none was given, the device is silent, an echo differs, or `stop` was
// asked.
Result<Started> start(Transport& transport, std::span<const std::byte> firmware,
                      const std::stop_token& stop = {});

} // namespace palpate::haptics::falcon
