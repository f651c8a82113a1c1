// The driver as the loader finds it by a manifest: a shared library of its own, with layers such as
// validation above it. For tests; programs hold the driver themselves.

#include <vulkan/vulkan_core.h>

#include <string_view>

#include "engine/native/driver/driver.h"

namespace {

constexpr uint32_t kLoaderInterface = 5; // since when the loader calls drivers of Vulkan 1.1 and up

} // namespace

extern "C" {

[[gnu::visibility("default")]] VkResult vk_icdNegotiateLoaderICDInterfaceVersion(
    uint32_t* version) {
    if (*version < kLoaderInterface)
        return VK_ERROR_INCOMPATIBLE_DRIVER;
    *version = kLoaderInterface;
    palpate::native::serve_the_loader();
    return VK_SUCCESS;
}

[[gnu::visibility("default")]] PFN_vkVoidFunction vk_icdGetInstanceProcAddr(VkInstance instance,
                                                                            const char* name) {
    return palpate::native::get_instance_proc_addr(instance, name);
}

[[gnu::visibility("default")]] PFN_vkVoidFunction vk_icdGetPhysicalDeviceProcAddr(
    VkInstance instance, const char* name) {
    return std::string_view(name).starts_with("vkGetPhysicalDevice")
               ? palpate::native::get_instance_proc_addr(instance, name)
               : nullptr;
}
}
