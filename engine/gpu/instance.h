#pragma once

#include <vulkan/vulkan_core.h>

#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace palpate {

// A Vulkan device as a person chooses it.
struct DeviceInfo {
    uint32_t index = 0; // as listed on this machine
    std::string name;   // "llvmpipe (LLVM 15.0.6, 256 bits)"
    std::string driver; // "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
    VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
    uint32_t api_version = 0;
    uint64_t memory_bytes = 0; // of the largest device-local heap
    std::string refusal;       // why it cannot be used; empty if it can
    bool is_cpu() const { return type == VK_PHYSICAL_DEVICE_TYPE_CPU; }
};

// Subgroup operations that the shaders use. A device that lacks one of these is refused.
constexpr VkSubgroupFeatureFlags kSubgroupOperations =
    VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT |
    VK_SUBGROUP_FEATURE_ARITHMETIC_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;

// Why compute shaders cannot do them on a device with these operations in these stages; empty if
// they can.
std::string subgroup_refusal(VkShaderStageFlags stages, VkSubgroupFeatureFlags operations);

// The Vulkan loader and what validation has said. One per GpuDevice; made without any window
// system.
class Instance {
 public:
    // validation: load the Khronos layer with synchronisation validation; throws GpuError where the
    // layer is not installed. `extensions` that the loader does not have are told by a GpuError.
    explicit Instance(bool validation, std::span<const std::string> extensions = {});
    // One that the caller made and destroys; for Vulkan 1.3.
    explicit Instance(VkInstance adopted);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    VkInstance handle() const { return handle_; }
    bool has_debug_utils() const { return has_debug_utils_; }
    // Whether passes may be named in command buffers: not beside a validation layer that breaks on
    // it.
    bool labels_commands() const { return labels_commands_; }

    struct Candidate {
        VkPhysicalDevice handle;
        DeviceInfo info;
    };
    std::vector<Candidate> candidates() const;

    // Warnings and errors of the validation layer so far.
    std::vector<std::string> messages() const;

 private:
    static VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT*, void*);

    VkInstance handle_ = VK_NULL_HANDLE;
    bool owned_ = true;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    bool has_debug_utils_ = false, labels_commands_ = false;
    mutable std::mutex mutex_;
    std::vector<std::string> messages_;
};

// The properties of a device; `refusal` says why the engine cannot use it.
DeviceInfo describe(VkPhysicalDevice device, uint32_t index);

// The first feature that the engine needs and that is not there; null where all are. As queried, or
// as a device was made with: what the chain does not hold is not there.
const char* missing_feature(const VkPhysicalDeviceFeatures2& features);

// Every Vulkan device of this machine, usable or not. Throws GpuError where there is no loader.
std::vector<DeviceInfo> list_devices();

} // namespace palpate
