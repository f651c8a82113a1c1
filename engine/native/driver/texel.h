#pragma once

#include <vulkan/vulkan_core.h>

#include <array>
#include <cstddef>

namespace palpate::native::driver {

// A texel of a format that texel_bytes() knows, as it lies in memory: its first texel_bytes(). Of
// formats between 0 and 1 (or -1 and 1) as Vulkan rounds: clamped, then to the nearest.
std::array<std::byte, 16> texel_of(VkFormat format, const VkClearColorValue& color);

} // namespace palpate::native::driver
