#pragma once

#include <vulkan/vulkan_core.h>

namespace palpate {

// Loads volk's table, which serves the whole process, with functions that look at the handle they
// are given and call the private driver (engine/native/driver) or the system's loader. Any number
// of instances and devices of both may be used side by side. The private device stands behind those
// of the system in vkEnumeratePhysicalDevices; where the system has no loader, or no driver for it,
// vkCreateInstance makes an instance of the private driver.
void load_vulkan();

// Why nothing can be drawn where there is neither a driver nor native code.
inline constexpr const char* kNoDriver =
    "expected a Vulkan driver, found none (Debian's mesa-vulkan-drivers has one that needs no "
    "graphics card)";

// Loads what the loader has for an instance: its extensions, above all. Functions loaded before
// stay, for an instance without an extension has no functions of it.
void load_vulkan(VkInstance instance);

} // namespace palpate
