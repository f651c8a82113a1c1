#pragma once

#include <vulkan/vulkan_core.h>

// A Vulkan driver inside the library: one physical device, whose compute shaders are native code of
// this processor (engine/native/kernel.h) and whose memory is the host's. It has what the engine
// calls (functions.h); every other call fails with a sentence on standard error, and an error
// code where the function returns one. See docs/decisions/19-a-driver-of-our-own.md.
namespace palpate::native {

// By name: functions of the lists in functions.h and those without a handle; null for all others.
PFN_vkVoidFunction VKAPI_CALL get_instance_proc_addr(VkInstance instance, const char* name);

// The one physical device. Lives as long as the program.
VkPhysicalDevice physical_device();

// Whether an instance, a physical device, a device, a queue or a command buffer is the driver's.
bool is_native(const void* dispatchable);

// For the loader, which writes a word of its own into every such handle: all handles made from now
// on begin with the word that it expects, and is_native() knows none of them.
void serve_the_loader();

} // namespace palpate::native
