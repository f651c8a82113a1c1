// The device itself: its limits, features, formats, memory and queues.

#include <algorithm>
#include <cstring>
#include <ctime>

#include "engine/base/memory.h"
#include "engine/native/driver/api.h"
#include "engine/native/driver/driver.h"
#include "engine/native/driver/features.h"
#include "engine/native/driver/objects.h"

namespace palpate::native {

VkPhysicalDevice physical_device() {
    static driver::Physical one;
    return driver::handle_of<VkPhysicalDevice>(&one);
}

namespace driver {

namespace {

constexpr uint32_t kSubgroupSize = 8;
constexpr uint32_t kDescriptors = 128; // of each kind
constexpr VkSubgroupFeatureFlags kSubgroupOperations =
    VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT |
    VK_SUBGROUP_FEATURE_ARITHMETIC_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;

constexpr VkExtensionProperties kExtensions[] = {
    {VK_EXT_CALIBRATED_TIMESTAMPS_EXTENSION_NAME, VK_EXT_CALIBRATED_TIMESTAMPS_SPEC_VERSION},
    {VK_EXT_MEMORY_BUDGET_EXTENSION_NAME, VK_EXT_MEMORY_BUDGET_SPEC_VERSION}};

VkPhysicalDeviceLimits limits() {
    VkPhysicalDeviceLimits l{};
    l.maxImageDimension1D = l.maxImageDimension2D = 16384;
    l.maxImageDimension3D = 4096;
    l.maxImageArrayLayers = 2048;
    l.maxUniformBufferRange = 65536;
    l.maxStorageBufferRange = 1u << 30; // offsets of kernels have 32 bits with a sign
    l.maxPushConstantsSize = sizeof(CommandBuffer::push_constants);
    l.maxMemoryAllocationCount = l.maxSamplerAllocationCount = UINT32_MAX;
    l.bufferImageGranularity = 1;
    l.maxBoundDescriptorSets = std::tuple_size_v<decltype(CommandBuffer::sets)>;
    l.maxPerStageDescriptorSamplers = l.maxPerStageDescriptorUniformBuffers =
        l.maxPerStageDescriptorStorageBuffers = l.maxPerStageDescriptorSampledImages =
            l.maxPerStageDescriptorStorageImages = l.maxPerStageResources =
                l.maxDescriptorSetSamplers = l.maxDescriptorSetUniformBuffers =
                    l.maxDescriptorSetStorageBuffers = l.maxDescriptorSetSampledImages =
                        l.maxDescriptorSetStorageImages = kDescriptors;
    l.maxVertexInputBindings = 1;
    l.maxVertexInputAttributes = 3;
    l.maxVertexInputBindingStride = l.maxVertexInputAttributeOffset = 20;
    l.maxFragmentOutputAttachments = l.maxColorAttachments = l.maxViewports = 1;
    l.maxViewportDimensions[0] = l.maxViewportDimensions[1] = 16384;
    l.viewportBoundsRange[0] = -32768.0f;
    l.viewportBoundsRange[1] = 32767.0f;
    l.maxFramebufferWidth = l.maxFramebufferHeight = 16384;
    l.maxFramebufferLayers = 1;
    l.framebufferColorSampleCounts = VK_SAMPLE_COUNT_1_BIT;
    l.subPixelPrecisionBits = 8;
    l.maxComputeSharedMemorySize = 32768;
    for (size_t i = 0; i < 3; ++i) {
        l.maxComputeWorkGroupCount[i] = 65535;
        l.maxComputeWorkGroupSize[i] = 1024;
    }
    l.maxComputeWorkGroupInvocations = 1024;
    l.subTexelPrecisionBits = 8;
    l.minMemoryMapAlignment = 64;
    l.minTexelBufferOffsetAlignment = l.minUniformBufferOffsetAlignment =
        l.minStorageBufferOffsetAlignment = 16;
    l.timestampComputeAndGraphics = VK_TRUE;
    l.timestampPeriod = 1.0f;
    l.optimalBufferCopyOffsetAlignment = l.optimalBufferCopyRowPitchAlignment = 16;
    l.nonCoherentAtomSize = 1;
    l.standardSampleLocations = VK_TRUE;
    return l;
}

// Descriptors are never updated while they are bound; layers compare with these limits all the
// same.
template <class Properties>
void put_descriptor_limits(Properties& p) {
    p.maxUpdateAfterBindDescriptorsInAllPools = p.maxPerStageUpdateAfterBindResources =
        kDescriptors;
    p.maxPerStageDescriptorUpdateAfterBindSamplers =
        p.maxPerStageDescriptorUpdateAfterBindUniformBuffers =
            p.maxPerStageDescriptorUpdateAfterBindStorageBuffers =
                p.maxPerStageDescriptorUpdateAfterBindSampledImages =
                    p.maxPerStageDescriptorUpdateAfterBindStorageImages = kDescriptors;
    p.maxDescriptorSetUpdateAfterBindSamplers = p.maxDescriptorSetUpdateAfterBindUniformBuffers =
        p.maxDescriptorSetUpdateAfterBindStorageBuffers =
            p.maxDescriptorSetUpdateAfterBindSampledImages =
                p.maxDescriptorSetUpdateAfterBindStorageImages = kDescriptors;
}

VkFormatFeatureFlags features_of(VkFormat format) {
    if (texel_bytes(format) == 0)
        return 0;
    const bool is_integer = format == VK_FORMAT_R8_UINT || format == VK_FORMAT_R16_UINT ||
                            format == VK_FORMAT_R32_UINT || format == VK_FORMAT_R32G32_UINT ||
                            format == VK_FORMAT_R32G32B32A32_UINT;
    const bool is_drawn_to =
        format == VK_FORMAT_R8G8B8A8_UNORM || format == VK_FORMAT_B8G8R8A8_UNORM;
    return VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT |
           VK_FORMAT_FEATURE_TRANSFER_SRC_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT |
           (is_integer ? VkFormatFeatureFlags{0}
                       : VkFormatFeatureFlags{VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT}) |
           (is_drawn_to ? VkFormatFeatureFlags{VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT |
                                               VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BLEND_BIT}
                        : VkFormatFeatureFlags{0});
}

// Copies a text into a member of fixed length.
template <size_t n>
void put(char (&to)[n], const std::string& text) {
    const size_t count = std::min(text.size(), n - 1);
    std::memcpy(to, text.data(), count);
    to[count] = '\0';
}

// The most that this process can hold: what the kernel says is free, and what it has.
uint64_t budget_bytes(uint64_t used) {
    const uint64_t all = physical_memory_bytes();
    return std::min(all, used + available_memory_bytes());
}

template <class T>
VkResult list(const T* all, uint32_t size, uint32_t* count, T* out) {
    if (!out) {
        *count = size;
        return VK_SUCCESS;
    }
    const uint32_t given = std::min(*count, size);
    std::copy_n(all, given, out);
    *count = given;
    return given < size ? VK_INCOMPLETE : VK_SUCCESS;
}

} // namespace

namespace api {

void vkGetPhysicalDeviceProperties(VkPhysicalDevice, VkPhysicalDeviceProperties* out) {
    *out = {};
    out->apiVersion = VK_API_VERSION_1_3;
    out->driverVersion = 1;
    out->deviceType = VK_PHYSICAL_DEVICE_TYPE_CPU;
    put(out->deviceName, fmt::format("palpate native ({}, {} lanes)", instructions(), width()));
    put(reinterpret_cast<char(&)[VK_UUID_SIZE]>(out->pipelineCacheUUID), "palpate native");
    out->limits = limits();
}

void vkGetPhysicalDeviceProperties2(VkPhysicalDevice device, VkPhysicalDeviceProperties2* out) {
    vkGetPhysicalDeviceProperties(device, &out->properties);
    for (auto* next = static_cast<VkBaseOutStructure*>(out->pNext); next; next = next->pNext) {
        const auto as = [&]<class T>(T) -> T& { return *reinterpret_cast<T*>(next); };
        switch (next->sType) {
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES: {
                auto& p = as(VkPhysicalDeviceDriverProperties{});
                put(p.driverName, "palpate");
                put(p.driverInfo, instructions());
                break;
            }
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES: {
                auto& p = as(VkPhysicalDeviceSubgroupProperties{});
                p.subgroupSize = kSubgroupSize;
                p.supportedStages = VK_SHADER_STAGE_COMPUTE_BIT;
                p.supportedOperations = kSubgroupOperations;
                break;
            }
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES: {
                auto& p = as(VkPhysicalDeviceVulkan11Properties{});
                p.subgroupSize = kSubgroupSize;
                p.subgroupSupportedStages = VK_SHADER_STAGE_COMPUTE_BIT;
                p.subgroupSupportedOperations = kSubgroupOperations;
                p.maxPerSetDescriptors = 1024;
                p.maxMemoryAllocationSize = physical_memory_bytes();
                break;
            }
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES: {
                auto& p = as(VkPhysicalDeviceVulkan12Properties{});
                put(p.driverName, "palpate");
                put(p.driverInfo, instructions());
                p.maxTimelineSemaphoreValueDifference = UINT64_MAX;
                put_descriptor_limits(p);
                break;
            }
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DESCRIPTOR_INDEXING_PROPERTIES:
                put_descriptor_limits(as(VkPhysicalDeviceDescriptorIndexingProperties{}));
                break;
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES: {
                auto& p = as(VkPhysicalDeviceVulkan13Properties{});
                p.minSubgroupSize = p.maxSubgroupSize = kSubgroupSize;
                p.maxBufferSize = physical_memory_bytes();
                break;
            }
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES: {
                auto& p = as(VkPhysicalDeviceMaintenance3Properties{});
                p.maxPerSetDescriptors = 1024;
                p.maxMemoryAllocationSize = physical_memory_bytes();
                break;
            }
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES:
                as(VkPhysicalDeviceMaintenance4Properties{}).maxBufferSize =
                    physical_memory_bytes();
                break;
            default:
                break; // structures that nobody here knows stay as they are, says Vulkan
        }
    }
}

void vkGetPhysicalDeviceFeatures(VkPhysicalDevice, VkPhysicalDeviceFeatures* out) {
    *out = core_features();
}

void vkGetPhysicalDeviceFeatures2(VkPhysicalDevice, VkPhysicalDeviceFeatures2* out) {
    out->features = core_features();
    for (auto* next = static_cast<VkBaseOutStructure*>(out->pNext); next; next = next->pNext)
        fill_features(*next);
}

void vkGetPhysicalDeviceFormatProperties(VkPhysicalDevice, VkFormat format,
                                         VkFormatProperties* out) {
    *out = {.optimalTilingFeatures = features_of(format)};
}

void vkGetPhysicalDeviceFormatProperties2(VkPhysicalDevice device, VkFormat format,
                                          VkFormatProperties2* out) {
    vkGetPhysicalDeviceFormatProperties(device, format, &out->formatProperties);
    for (auto* next = static_cast<VkBaseOutStructure*>(out->pNext); next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_FORMAT_PROPERTIES_3) {
            auto& p = *reinterpret_cast<VkFormatProperties3*>(next);
            p.linearTilingFeatures = p.bufferFeatures = 0;
            p.optimalTilingFeatures = features_of(format);
            if (p.optimalTilingFeatures)
                p.optimalTilingFeatures |= VK_FORMAT_FEATURE_2_STORAGE_READ_WITHOUT_FORMAT_BIT |
                                           VK_FORMAT_FEATURE_2_STORAGE_WRITE_WITHOUT_FORMAT_BIT;
        }
}

VkResult vkGetPhysicalDeviceImageFormatProperties(VkPhysicalDevice, VkFormat format,
                                                  VkImageType type, VkImageTiling tiling,
                                                  VkImageUsageFlags usage, VkImageCreateFlags flags,
                                                  VkImageFormatProperties* out) {
    VkImageUsageFlags known = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT |
                              VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    if (features_of(format) & VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT)
        known |= VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
    *out = {};
    if (texel_bytes(format) == 0 || tiling != VK_IMAGE_TILING_OPTIMAL || (usage & ~known) || flags)
        return VK_ERROR_FORMAT_NOT_SUPPORTED;
    const VkPhysicalDeviceLimits l = limits();
    const bool is_3d = type == VK_IMAGE_TYPE_3D;
    const uint32_t side = is_3d ? l.maxImageDimension3D : l.maxImageDimension2D;
    out->maxExtent = {side, type == VK_IMAGE_TYPE_1D ? 1 : side, is_3d ? side : 1};
    out->maxMipLevels = 1;
    out->maxArrayLayers = is_3d ? 1 : l.maxImageArrayLayers;
    out->sampleCounts = VK_SAMPLE_COUNT_1_BIT;
    out->maxResourceSize = physical_memory_bytes();
    return VK_SUCCESS;
}

VkResult vkGetPhysicalDeviceImageFormatProperties2(VkPhysicalDevice device,
                                                   const VkPhysicalDeviceImageFormatInfo2* info,
                                                   VkImageFormatProperties2* out) {
    return vkGetPhysicalDeviceImageFormatProperties(device, info->format, info->type, info->tiling,
                                                    info->usage, info->flags,
                                                    &out->imageFormatProperties);
}

void vkGetPhysicalDeviceSparseImageFormatProperties(VkPhysicalDevice, VkFormat, VkImageType,
                                                    VkSampleCountFlagBits, VkImageUsageFlags,
                                                    VkImageTiling, uint32_t* count,
                                                    VkSparseImageFormatProperties*) {
    *count = 0;
}

void vkGetPhysicalDeviceSparseImageFormatProperties2(VkPhysicalDevice,
                                                     const VkPhysicalDeviceSparseImageFormatInfo2*,
                                                     uint32_t* count,
                                                     VkSparseImageFormatProperties2*) {
    *count = 0;
}

void vkGetPhysicalDeviceMemoryProperties(VkPhysicalDevice, VkPhysicalDeviceMemoryProperties* out) {
    *out = {};
    out->memoryTypeCount = out->memoryHeapCount = 1;
    out->memoryTypes[0] = {
        VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
            VK_MEMORY_PROPERTY_HOST_COHERENT_BIT | VK_MEMORY_PROPERTY_HOST_CACHED_BIT,
        0};
    out->memoryHeaps[0] = {physical_memory_bytes(), VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
}

void vkGetPhysicalDeviceMemoryProperties2(VkPhysicalDevice device,
                                          VkPhysicalDeviceMemoryProperties2* out) {
    vkGetPhysicalDeviceMemoryProperties(device, &out->memoryProperties);
    for (auto* next = static_cast<VkBaseOutStructure*>(out->pNext); next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_BUDGET_PROPERTIES_EXT) {
            auto& p = *reinterpret_cast<VkPhysicalDeviceMemoryBudgetPropertiesEXT*>(next);
            std::fill_n(p.heapBudget, VK_MAX_MEMORY_HEAPS, VkDeviceSize{0});
            std::fill_n(p.heapUsage, VK_MAX_MEMORY_HEAPS, VkDeviceSize{0});
            p.heapUsage[0] = allocated_bytes();
            p.heapBudget[0] = budget_bytes(p.heapUsage[0]);
        }
}

void vkGetPhysicalDeviceQueueFamilyProperties(VkPhysicalDevice, uint32_t* count,
                                              VkQueueFamilyProperties* out) {
    const VkQueueFamilyProperties one{
        .queueFlags = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT | VK_QUEUE_TRANSFER_BIT,
        .queueCount = kQueues,
        .timestampValidBits = 64,
        .minImageTransferGranularity = {1, 1, 1}};
    list(&one, 1, count, out);
}

void vkGetPhysicalDeviceQueueFamilyProperties2(VkPhysicalDevice device, uint32_t* count,
                                               VkQueueFamilyProperties2* out) {
    vkGetPhysicalDeviceQueueFamilyProperties(device, count,
                                             out ? &out->queueFamilyProperties : nullptr);
}

VkResult vkEnumerateDeviceExtensionProperties(VkPhysicalDevice, const char* layer, uint32_t* count,
                                              VkExtensionProperties* out) {
    if (layer)
        return VK_ERROR_LAYER_NOT_PRESENT;
    return list(kExtensions, std::size(kExtensions), count, out);
}

VkResult vkEnumerateDeviceLayerProperties(VkPhysicalDevice, uint32_t* count, VkLayerProperties*) {
    *count = 0;
    return VK_SUCCESS;
}

VkResult vkEnumeratePhysicalDevices(VkInstance, uint32_t* count, VkPhysicalDevice* out) {
    const VkPhysicalDevice one = physical_device();
    return list(&one, kernels().empty() ? 0 : 1, count, out);
}

VkResult vkGetPhysicalDeviceCalibrateableTimeDomainsEXT(VkPhysicalDevice, uint32_t* count,
                                                        VkTimeDomainEXT* out) {
    constexpr VkTimeDomainEXT all[] = {VK_TIME_DOMAIN_DEVICE_EXT,
                                       VK_TIME_DOMAIN_CLOCK_MONOTONIC_EXT};
    return list(all, 2, count, out);
}

} // namespace api
} // namespace driver
} // namespace palpate::native
