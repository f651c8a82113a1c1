#include "engine/native/driver/features.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <optional>

namespace palpate::native::driver {

namespace {

VkPhysicalDeviceVulkan11Features features_11() {
    return {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES};
}

VkPhysicalDeviceVulkan12Features features_12() {
    return {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
            .shaderBufferInt64Atomics = VK_TRUE,
            .scalarBlockLayout = VK_TRUE,
            .timelineSemaphore = VK_TRUE};
}

VkPhysicalDeviceVulkan13Features features_13() {
    return {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
            .synchronization2 = VK_TRUE,
            .dynamicRendering = VK_TRUE,
            .maintenance4 = VK_TRUE};
}

// Calls `visit` with the switches of a structure, those that the driver has, and their number.
template <class Structure, class Visit>
void for_known(Structure& structure, const Visit& visit) {
    const auto all = [&](const auto& known, const VkBool32& last) {
        const auto* first = reinterpret_cast<const std::byte*>(&known) + sizeof(VkBaseOutStructure);
        const auto* end = reinterpret_cast<const std::byte*>(&last + 1);
        visit(&structure + 1, first, static_cast<size_t>(end - first) / sizeof(VkBool32));
    };
    switch (structure.sType) {
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES: {
            const auto known = features_11();
            return all(known, known.shaderDrawParameters);
        }
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES: {
            const auto known = features_12();
            return all(known, known.subgroupBroadcastDynamicId);
        }
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES: {
            const auto known = features_13();
            return all(known, known.maintenance4);
        }
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES: {
            const VkPhysicalDeviceTimelineSemaphoreFeatures known{.timelineSemaphore = VK_TRUE};
            return all(known, known.timelineSemaphore);
        }
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SCALAR_BLOCK_LAYOUT_FEATURES: {
            const VkPhysicalDeviceScalarBlockLayoutFeatures known{.scalarBlockLayout = VK_TRUE};
            return all(known, known.scalarBlockLayout);
        }
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES: {
            const VkPhysicalDeviceSynchronization2Features known{.synchronization2 = VK_TRUE};
            return all(known, known.synchronization2);
        }
        case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_FEATURES: {
            const VkPhysicalDeviceMaintenance4Features known{.maintenance4 = VK_TRUE};
            return all(known, known.maintenance4);
        }
        default:
            return;
    }
}

// The place of the first switch that is asked for and that the driver lacks.
std::optional<size_t> first_missing(const void* wanted, const void* has, size_t count) {
    const auto at = [](const void* from, size_t i) {
        VkBool32 on = VK_FALSE;
        std::memcpy(&on, static_cast<const std::byte*>(from) + i * sizeof on, sizeof on);
        return on != VK_FALSE;
    };
    for (size_t i = 0; i < count; ++i)
        if (at(wanted, i) && !at(has, i))
            return i;
    return std::nullopt;
}

} // namespace

VkPhysicalDeviceFeatures core_features() {
    return {.robustBufferAccess = VK_TRUE,
            .shaderStorageImageExtendedFormats = VK_TRUE,
            .shaderStorageImageReadWithoutFormat = VK_TRUE,
            .shaderStorageImageWriteWithoutFormat = VK_TRUE,
            .shaderInt64 = VK_TRUE}; // as far as the translator knows them
}

void fill_features(VkBaseOutStructure& structure) {
    for_known(structure, [](void* to, const void* has, size_t count) {
        std::memcpy(to, has, count * sizeof(VkBool32));
    });
}

std::string feature_refusal(const VkDeviceCreateInfo& info) {
    std::string why;
    const auto check_core = [&](const VkPhysicalDeviceFeatures& wanted) {
        const VkPhysicalDeviceFeatures has = core_features();
        if (const auto missing = first_missing(&wanted, &has, sizeof has / sizeof(VkBool32)))
            why = fmt::format("the feature at {} of VkPhysicalDeviceFeatures", *missing);
    };
    if (info.pEnabledFeatures)
        check_core(*info.pEnabledFeatures);
    for (auto* next = static_cast<const VkBaseOutStructure*>(info.pNext); next && why.empty();
         next = next->pNext) {
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2) {
            check_core(reinterpret_cast<const VkPhysicalDeviceFeatures2*>(next)->features);
            continue;
        }
        for_known(*next, [&](const void* wanted, const void* has, size_t count) {
            if (const auto missing = first_missing(wanted, has, count))
                why = fmt::format("the feature at {} of the structure {}", *missing,
                                  static_cast<int>(next->sType));
        });
    }
    return why;
}

} // namespace palpate::native::driver
