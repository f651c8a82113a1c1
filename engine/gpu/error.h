#pragma once

#include <vulkan/vulkan_core.h>

#include <stdexcept>
#include <string>

namespace palpate {

// A failure of the machine: of a Vulkan call, a lost device, memory that ran out. Caught in
// main and by the test runner; the picture so far is not written.
class GpuError : public std::runtime_error {
 public:
    using std::runtime_error::runtime_error;
};

// "VK_ERROR_DEVICE_LOST" and the like.
const char* name_of(VkResult result);

// Throws GpuError unless the call succeeded. `what` says what was tried: "creating an image".
void check(VkResult result, const std::string& what);

} // namespace palpate
