#pragma once

#include <vulkan/vulkan_core.h>

#include <string>

// The features of Vulkan that kernels and commands have.
namespace palpate::native::driver {

VkPhysicalDeviceFeatures core_features();
// Fills one structure of a chain; structures that are not about features stay as they are.
void fill_features(VkBaseOutStructure& structure);
// Why a device cannot be made with these features; empty if it can.
std::string feature_refusal(const VkDeviceCreateInfo& info);

} // namespace palpate::native::driver
