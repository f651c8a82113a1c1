#include "engine/gpu/instance.h"

#include <cstring>
#define VOLK_IMPLEMENTATION
#include <volk.h>

#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/gpu/dispatch.h"
#include "engine/gpu/error.h"

namespace palpate {

namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

// Layers before this one drop the labels of a command buffer on a thread of their own, without a
// lock, while others are recorded, which now and then ends the process with a broken heap.
// (Khronos, Vulkan-ValidationLayers, commit 2a430d9d3.)
constexpr uint32_t kFirstWithSafeLabels = VK_MAKE_API_VERSION(0, 1, 3, 243);

// 0 where it is not installed.
uint32_t version_of_layer(const char* name) {
    uint32_t count = 0;
    vkEnumerateInstanceLayerProperties(&count, nullptr);
    std::vector<VkLayerProperties> layers(count);
    vkEnumerateInstanceLayerProperties(&count, layers.data());
    for (const auto& layer : layers)
        if (std::strcmp(layer.layerName, name) == 0)
            return layer.specVersion;
    return 0;
}

bool has_instance_extension(const char* name, const char* layer) {
    uint32_t count = 0;
    vkEnumerateInstanceExtensionProperties(layer, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vkEnumerateInstanceExtensionProperties(layer, &count, extensions.data());
    for (const auto& extension : extensions)
        if (std::strcmp(extension.extensionName, name) == 0)
            return true;
    return false;
}

// The first requirement of the engine that a device lacks; empty if the device has it all.
std::string refusal_of(VkPhysicalDevice device, uint32_t api_version) {
    if (api_version < VK_API_VERSION_1_3)
        return fmt::format("expected Vulkan 1.3, found {}.{}", VK_API_VERSION_MAJOR(api_version),
                           VK_API_VERSION_MINOR(api_version));
    VkPhysicalDeviceVulkan13Features v13{.sType =
                                             VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceVulkan12Features v12{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES, .pNext = &v13};
    VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2,
                                       .pNext = &v12};
    vkGetPhysicalDeviceFeatures2(device, &features);
    if (const char* name = missing_feature(features))
        return fmt::format("the feature {} is missing", name);
    VkPhysicalDeviceSubgroupProperties subgroups{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES};
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
                                           .pNext = &subgroups};
    vkGetPhysicalDeviceProperties2(device, &properties);
    if (const std::string why =
            subgroup_refusal(subgroups.supportedStages, subgroups.supportedOperations);
        !why.empty())
        return why;
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    for (const auto& family : families)
        if (family.queueFlags & VK_QUEUE_COMPUTE_BIT)
            return "";
    return "no queue can compute";
}

} // namespace

DeviceInfo describe(VkPhysicalDevice device, uint32_t index) {
    VkPhysicalDeviceDriverProperties driver{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
                                           .pNext = &driver};
    vkGetPhysicalDeviceProperties2(device, &properties);
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(device, &memory);
    DeviceInfo info;
    info.index = index;
    info.name = properties.properties.deviceName;
    info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
    info.type = properties.properties.deviceType;
    info.api_version = properties.properties.apiVersion;
    for (uint32_t h = 0; h < memory.memoryHeapCount; ++h)
        if (memory.memoryHeaps[h].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
            info.memory_bytes = std::max<uint64_t>(info.memory_bytes, memory.memoryHeaps[h].size);
    info.refusal = refusal_of(device, info.api_version);
    return info;
}

const char* missing_feature(const VkPhysicalDeviceFeatures2& features) {
    bool timeline = false, scalar = false, synchronization = false, maintenance = false;
    const auto* next = static_cast<const VkBaseInStructure*>(features.pNext);
    for (; next; next = next->pNext) {
        const auto as = [&]<class T>(T) { return reinterpret_cast<const T*>(next); };
        switch (next->sType) {
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES:
                timeline |= as(VkPhysicalDeviceVulkan12Features{})->timelineSemaphore != 0;
                scalar |= as(VkPhysicalDeviceVulkan12Features{})->scalarBlockLayout != 0;
                break;
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES:
                synchronization |= as(VkPhysicalDeviceVulkan13Features{})->synchronization2 != 0;
                maintenance |= as(VkPhysicalDeviceVulkan13Features{})->maintenance4 != 0;
                break;
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES:
                timeline |= as(VkPhysicalDeviceTimelineSemaphoreFeatures{})->timelineSemaphore != 0;
                break;
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SCALAR_BLOCK_LAYOUT_FEATURES:
                scalar |= as(VkPhysicalDeviceScalarBlockLayoutFeatures{})->scalarBlockLayout != 0;
                break;
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES:
                synchronization |=
                    as(VkPhysicalDeviceSynchronization2Features{})->synchronization2 != 0;
                break;
            case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_FEATURES:
                maintenance |= as(VkPhysicalDeviceMaintenance4Features{})->maintenance4 != 0;
                break;
            default:
                break;
        }
    }
    return !timeline          ? "timelineSemaphore"
           : !scalar          ? "scalarBlockLayout"
           : !synchronization ? "synchronization2"
           : !maintenance     ? "maintenance4"
                              : nullptr;
}

std::string subgroup_refusal(VkShaderStageFlags stages, VkSubgroupFeatureFlags operations) {
    if (!(stages & VK_SHADER_STAGE_COMPUTE_BIT))
        return "compute shaders cannot use subgroups";
    for (const auto& [operation, name] :
         {std::pair(VK_SUBGROUP_FEATURE_BASIC_BIT, "basic operations"),
          {VK_SUBGROUP_FEATURE_VOTE_BIT, "votes"},
          {VK_SUBGROUP_FEATURE_ARITHMETIC_BIT, "arithmetic"},
          {VK_SUBGROUP_FEATURE_BALLOT_BIT, "ballots"}})
        if (!(operations & operation))
            return fmt::format("{} of subgroups are missing", name);
    return "";
}

const char* name_of(VkResult result) {
    constexpr std::pair<VkResult, const char*> names[] = {
        {VK_SUCCESS, "VK_SUCCESS"},
        {VK_NOT_READY, "VK_NOT_READY"},
        {VK_TIMEOUT, "VK_TIMEOUT"},
        {VK_ERROR_OUT_OF_HOST_MEMORY, "VK_ERROR_OUT_OF_HOST_MEMORY"},
        {VK_ERROR_OUT_OF_DEVICE_MEMORY, "VK_ERROR_OUT_OF_DEVICE_MEMORY"},
        {VK_ERROR_INITIALIZATION_FAILED, "VK_ERROR_INITIALIZATION_FAILED"},
        {VK_ERROR_DEVICE_LOST, "VK_ERROR_DEVICE_LOST"},
        {VK_ERROR_LAYER_NOT_PRESENT, "VK_ERROR_LAYER_NOT_PRESENT"},
        {VK_ERROR_EXTENSION_NOT_PRESENT, "VK_ERROR_EXTENSION_NOT_PRESENT"},
        {VK_ERROR_FEATURE_NOT_PRESENT, "VK_ERROR_FEATURE_NOT_PRESENT"},
        {VK_ERROR_INCOMPATIBLE_DRIVER, "VK_ERROR_INCOMPATIBLE_DRIVER"},
        {VK_ERROR_FORMAT_NOT_SUPPORTED, "VK_ERROR_FORMAT_NOT_SUPPORTED"}};
    for (const auto& [known, name] : names)
        if (result == known)
            return name;
    return "an unnamed VkResult";
}

void check(VkResult result, const std::string& what) {
    if (result != VK_SUCCESS)
        throw GpuError(fmt::format("graphics device: {} failed with {} ({})", what, name_of(result),
                                   static_cast<int>(result)));
}

Instance::Instance(VkInstance adopted) : handle_(adopted), owned_(false) {
    load_vulkan();
    load_vulkan(adopted);
}

Instance::Instance(bool validation, std::span<const std::string> wanted) {
    const profile::Scope scope("load the graphics driver");
    load_vulkan();
    const uint32_t layer_version = validation ? version_of_layer(kValidationLayer) : 0;
    if (validation && layer_version == 0)
        throw GpuError("the Vulkan validation layer is not installed (vulkan-validationlayers)");
    has_debug_utils_ =
        has_instance_extension(VK_EXT_DEBUG_UTILS_EXTENSION_NAME, nullptr) ||
        (validation && has_instance_extension(VK_EXT_DEBUG_UTILS_EXTENSION_NAME, kValidationLayer));
    labels_commands_ = has_debug_utils_ && (!validation || layer_version >= kFirstWithSafeLabels);

    const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                        .pApplicationName = "palpate",
                                        .pEngineName = "palpate",
                                        .apiVersion = VK_API_VERSION_1_3};
    const VkValidationFeatureEnableEXT enable =
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    const VkDebugUtilsMessengerCreateInfoEXT messenger{
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                       VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
        .pfnUserCallback = &Instance::on_message,
        .pUserData = this};
    const VkValidationFeaturesEXT features{.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                           .enabledValidationFeatureCount = 1,
                                           .pEnabledValidationFeatures = &enable};
    std::vector<const char*> extensions;
    if (has_debug_utils_)
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (validation)
        extensions.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
    for (const std::string& name : wanted) {
        if (!has_instance_extension(name.c_str(), nullptr))
            throw GpuError(fmt::format("the Vulkan loader: the extension {} is missing", name));
        extensions.push_back(name.c_str());
    }
    const VkInstanceCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
        .pNext = validation ? &features : nullptr,
        .pApplicationInfo = &application,
        .enabledLayerCount = validation ? 1u : 0u,
        .ppEnabledLayerNames = &kValidationLayer,
        .enabledExtensionCount = static_cast<uint32_t>(extensions.size()),
        .ppEnabledExtensionNames = extensions.data()};
    const VkResult made = vkCreateInstance(&create, nullptr, &handle_);
    if (made == VK_ERROR_INCOMPATIBLE_DRIVER)
        throw GpuError(kNoDriver);
    check(made, "creating a Vulkan instance");
    load_vulkan(handle_);
    if (validation && has_debug_utils_)
        check(vkCreateDebugUtilsMessengerEXT(handle_, &messenger, nullptr, &messenger_),
              "listening to validation");
}

Instance::~Instance() {
    if (!owned_)
        return;
    if (messenger_)
        vkDestroyDebugUtilsMessengerEXT(handle_, messenger_, nullptr);
    vkDestroyInstance(handle_, nullptr);
}

VkBool32 VKAPI_CALL Instance::on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                         VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data,
                                         void* user) {
    auto& instance = *static_cast<Instance*>(user);
    const std::scoped_lock lock(instance.mutex_);
    instance.messages_.emplace_back(data->pMessage);
    log::warning("Vulkan validation: {}", data->pMessage);
    return VK_FALSE;
}

std::vector<std::string> Instance::messages() const {
    const std::scoped_lock lock(mutex_);
    return messages_;
}

std::vector<Instance::Candidate> Instance::candidates() const {
    uint32_t count = 0;
    check(vkEnumeratePhysicalDevices(handle_, &count, nullptr), "listing devices");
    std::vector<VkPhysicalDevice> handles(count);
    check(vkEnumeratePhysicalDevices(handle_, &count, handles.data()), "listing devices");
    std::vector<Candidate> found;
    for (uint32_t i = 0; i < count; ++i)
        found.push_back({handles[i], describe(handles[i], i)});
    return found;
}

std::vector<DeviceInfo> list_devices() {
    const Instance instance(false);
    std::vector<DeviceInfo> infos;
    for (const auto& candidate : instance.candidates())
        infos.push_back(candidate.info);
    return infos;
}

} // namespace palpate
