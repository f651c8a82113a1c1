#include "engine/gpu/device.h"

#include <volk.h>

#include <algorithm>
#include <cstdlib>

#include "engine/base/profile.h"
#include "engine/gpu/command_slot.h"
#include "engine/gpu/dispatch.h"
#include "engine/gpu/error.h"
#include "engine/native/driver/driver.h"
#include "engine/native/level.h"

namespace palpate {

namespace {

// Drivers of the processor come last: the engine's own first, which takes the least of its time,
// unless validation is asked for, whose layers see drivers of the system alone.
int preference(const Instance::Candidate& candidate, bool validation) {
    switch (candidate.info.type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return 5;
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return 4;
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return 3;
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return native::is_native(candidate.handle) && !validation ? 2 : 1;
        default:
            return 0;
    }
}

bool selects(const std::string& select, const DeviceInfo& info) {
    if (select.empty() || select == std::to_string(info.index))
        return true;
    const auto lower = [](std::string text) {
        std::transform(text.begin(), text.end(), text.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        return text;
    };
    return lower(info.name).find(lower(select)) != std::string::npos;
}

std::vector<VkQueueFamilyProperties> queue_families(VkPhysicalDevice device) {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    return families;
}

// The first that computes and, where that is asked for, presents.
std::optional<uint32_t> find_queue_family(const Instance& instance, VkPhysicalDevice device,
                                          const DeviceOptions& options) {
    const std::vector<VkQueueFamilyProperties> families = queue_families(device);
    for (uint32_t i = 0; i < families.size(); ++i)
        if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) &&
            (!options.can_present || options.can_present(instance.handle(), device, i)))
            return i;
    return std::nullopt;
}

bool has_extension(VkPhysicalDevice device, std::string_view name) {
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data());
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const auto& extension) { return extension.extensionName == name; });
}

// Why a device that the engine could use lacks what the caller asks for; empty if it has all.
std::string refusal_of(const Instance& instance, VkPhysicalDevice device,
                       const DeviceOptions& options) {
    for (const std::string& name : options.device_extensions)
        if (!has_extension(device, name))
            return name == VK_KHR_SWAPCHAIN_EXTENSION_NAME
                       ? "it opens no windows, for which the system needs a Vulkan driver, such as "
                         "mesa-vulkan-drivers"
                       : fmt::format("the extension {} is missing", name);
    if (!find_queue_family(instance, device, options))
        return "no queue both computes and presents";
    return "";
}

Instance::Candidate choose(const Instance& instance, const std::string& select,
                           const DeviceOptions& options) {
    auto candidates = instance.candidates();
    const Instance::Candidate* best = nullptr;
    std::string reasons;
    for (auto& candidate : candidates) {
        if (candidate.info.refusal.empty())
            candidate.info.refusal = refusal_of(instance, candidate.handle, options);
        if (!selects(select, candidate.info))
            reasons += fmt::format("; {} is not '{}'", candidate.info.name, select);
        else if (!candidate.info.refusal.empty())
            reasons += fmt::format("; {}: {}", candidate.info.name, candidate.info.refusal);
        else if (!best ||
                 preference(candidate, options.validation) > preference(*best, options.validation))
            best = &candidate;
    }
    if (candidates.empty())
        throw GpuError(kNoDriver);
    if (!best)
        throw GpuError(fmt::format("no Vulkan device can be used{}", reasons));
    return *best;
}

// The device reads its clock together with CLOCK_MONOTONIC, which profile::now_ns() counts in.
bool can_calibrate(VkPhysicalDevice device) {
    if (!has_extension(device, VK_EXT_CALIBRATED_TIMESTAMPS_EXTENSION_NAME))
        return false;
    uint32_t count = 0;
    vkGetPhysicalDeviceCalibrateableTimeDomainsEXT(device, &count, nullptr);
    std::vector<VkTimeDomainEXT> domains(count);
    vkGetPhysicalDeviceCalibrateableTimeDomainsEXT(device, &count, domains.data());
    const auto has = [&](VkTimeDomainEXT domain) {
        return std::find(domains.begin(), domains.end(), domain) != domains.end();
    };
    return has(VK_TIME_DOMAIN_DEVICE_EXT) && has(VK_TIME_DOMAIN_CLOCK_MONOTONIC_EXT);
}

// Whether graphics pipelines need no render pass: what windows are drawn with.
VkBool32 can_draw_dynamically(VkPhysicalDevice device) {
    VkPhysicalDeviceVulkan13Features v13{.sType =
                                             VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2,
                                       .pNext = &v13};
    vkGetPhysicalDeviceFeatures2(device, &features);
    return v13.dynamicRendering;
}

// Whether shaders may count and compare 64 bits at a time in storage buffers.
bool can_do_int64_atomics(VkPhysicalDevice device) {
    VkPhysicalDeviceVulkan12Features v12{.sType =
                                             VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    VkPhysicalDeviceFeatures2 features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2,
                                       .pNext = &v12};
    vkGetPhysicalDeviceFeatures2(device, &features);
    return features.features.shaderInt64 && v12.shaderBufferInt64Atomics;
}

} // namespace

GpuDevice::GpuDevice(const DeviceOptions& options)
    : instance_(options.validation, options.instance_extensions) {
    if (const std::string why = native::level_refusal(); !why.empty())
        throw GpuError(why);
    std::string select = options.select;
    if (const char* wish = std::getenv("PALPATE_DEVICE"); select.empty() && wish)
        select = wish;
    const Instance::Candidate chosen = choose(instance_, select, options);
    physical_ = chosen.handle;
    info_ = chosen.info;
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(physical_, &properties);
    limits_ = properties.limits;
    vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);

    queue_family_ = *find_queue_family(instance_, physical_, options);

    const float priorities[] = {1.0f, 1.0f};
    if (options.can_present) // beside the interface's one for pictures
        queue_count_ = std::min(2u, queue_families(physical_)[queue_family_].queueCount);
    const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                        .queueFamilyIndex = queue_family_,
                                        .queueCount = queue_count_,
                                        .pQueuePriorities = priorities};
    VkPhysicalDeviceVulkan13Features v13{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
        .synchronization2 = VK_TRUE,
        .dynamicRendering = options.can_present ? can_draw_dynamically(physical_) : VK_FALSE,
        .maintenance4 = VK_TRUE};
    int64_atomics_ = options.int64_atomics && can_do_int64_atomics(physical_);
    const VkPhysicalDeviceFeatures core{.shaderInt64 = int64_atomics_};
    VkPhysicalDeviceVulkan12Features v12{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        .pNext = &v13,
        .shaderBufferInt64Atomics = int64_atomics_,
        .scalarBlockLayout = VK_TRUE,
        .timelineSemaphore = VK_TRUE};
    calibrates_ = can_calibrate(physical_);
    std::vector<const char*> extensions;
    for (const std::string& name : options.device_extensions)
        extensions.push_back(name.c_str());
    if (calibrates_)
        extensions.push_back(VK_EXT_CALIBRATED_TIMESTAMPS_EXTENSION_NAME);
    const VkDeviceCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
        .pNext = &v12,
        .queueCreateInfoCount = 1,
        .pQueueCreateInfos = &queue,
        .enabledExtensionCount = static_cast<uint32_t>(extensions.size()),
        .ppEnabledExtensionNames = extensions.data(),
        .pEnabledFeatures = &core};
    {
        const profile::Scope scope("create the device");
        check(vkCreateDevice(physical_, &create, nullptr, &handle_),
              "creating a device on " + info_.name);
    }
    vkGetDeviceQueue(handle_, queue_family_, 0, &queue_);
    make_timeline();
}

GpuDevice::GpuDevice(const AdoptedDevice& adopted)
    : instance_(adopted.instance),
      info_(describe(adopted.physical, 0)),
      physical_(adopted.physical),
      handle_(adopted.device),
      queue_(adopted.queue),
      queue_family_(adopted.queue_family),
      owned_(false) {
    const auto refuse = [&](const std::string& why) {
        throw GpuError(fmt::format("the device {} that was handed over: {}", info_.name, why));
    };
    if (!info_.refusal.empty())
        refuse(info_.refusal);
    if (const char* name = missing_feature(*adopted.features))
        refuse(fmt::format("expected the feature {}, found it not enabled", name));
    const auto families = queue_families(physical_);
    if (queue_family_ >= families.size() ||
        !(families[queue_family_].queueFlags & VK_QUEUE_COMPUTE_BIT))
        refuse(fmt::format("expected a queue that computes, found family {}", queue_family_));
    for (auto* next = static_cast<const VkBaseInStructure*>(adopted.features->pNext); next;
         next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES)
            int64_atomics_ = adopted.features->features.shaderInt64 &&
                             reinterpret_cast<const VkPhysicalDeviceVulkan12Features*>(next)
                                 ->shaderBufferInt64Atomics;
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(physical_, &properties);
    limits_ = properties.limits;
    vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
    make_timeline();
}

GpuDevice::GpuDevice(GpuDevice& first)
    : instance_(first.instance()),
      info_(first.info_),
      physical_(first.physical_),
      handle_(first.handle_),
      limits_(first.limits_),
      memory_(first.memory_),
      queue_family_(first.queue_family_),
      owned_(false),
      calibrates_(first.calibrates_),
      int64_atomics_(first.int64_atomics_) {
    if (first.queue_count_ > 1) {
        vkGetDeviceQueue(handle_, queue_family_, 1, &queue_);
    } else {
        queue_ = first.queue_;
        queue_turn_ = first.queue_turn_;
    }
    make_timeline();
}

void GpuDevice::make_timeline() {
    const VkSemaphoreTypeCreateInfo type{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                         .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE};
    const VkSemaphoreCreateInfo semaphore{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO,
                                          .pNext = &type};
    check(vkCreateSemaphore(handle_, &semaphore, nullptr, &timeline_), "creating a timeline");
    staging_ = std::make_unique<StagingPool>();
}

void GpuDevice::wait_idle() const {
    const auto turn = queue_turn();
    vkQueueWaitIdle(queue_);
}

GpuDevice::~GpuDevice() {
    wait_idle();
    idle_slots_.clear();
    staging_.reset();
    while (!retired_.empty()) {
        const Retired oldest = std::move(retired_.front()); // which may hold more to be retired
        retired_.pop_front();
        oldest.destroy();
    }
    vkDestroySemaphore(handle_, timeline_, nullptr);
    if (owned_)
        vkDestroyDevice(handle_, nullptr);
}

bool GpuDevice::can_filter_linearly(VkFormat format) const {
    VkFormatProperties properties;
    vkGetPhysicalDeviceFormatProperties(physical_, format, &properties);
    return (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT) !=
           0;
}

std::unique_ptr<CommandSlot> GpuDevice::take_slot() {
    std::unique_ptr<CommandSlot> slot;
    if (!idle_slots_.empty() && idle_slots_.front().value <= passed()) {
        slot = std::move(idle_slots_.front().slot);
        idle_slots_.pop_front();
    } else {
        slot = std::make_unique<CommandSlot>(*this);
    }
    slot->begin();
    slot->recording_ = ++recordings_;
    open_recordings_.push_back(recordings_);
    return slot;
}

void GpuDevice::give_slot(std::unique_ptr<CommandSlot> slot, uint64_t value) {
    std::erase(open_recordings_, slot->recording_);
    slot->batch().give(*this, value);
    // Most come back in the order of their submissions.
    auto at = idle_slots_.end();
    while (at != idle_slots_.begin() && std::prev(at)->value > value)
        --at;
    idle_slots_.insert(at, {std::move(slot), value});
}

uint64_t GpuDevice::submit(CommandSlot& slot, std::span<const SemaphoreUse> waits,
                           std::span<const SemaphoreUse> signals) {
    const auto info_of = [](const SemaphoreUse& use) {
        return VkSemaphoreSubmitInfo{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                     .semaphore = use.semaphore,
                                     .value = use.value,
                                     .stageMask = use.stages};
    };
    std::vector<VkSemaphoreSubmitInfo> before, after{info_of({timeline_, submitted_ + 1})};
    for (const SemaphoreUse& use : waits)
        before.push_back(info_of(use));
    for (const SemaphoreUse& use : signals)
        after.push_back(info_of(use));
    const VkCommandBufferSubmitInfo buffer{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
                                           .commandBuffer = slot.commands()};
    const VkSubmitInfo2 submit{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                               .waitSemaphoreInfoCount = static_cast<uint32_t>(before.size()),
                               .pWaitSemaphoreInfos = before.data(),
                               .commandBufferInfoCount = 1,
                               .pCommandBufferInfos = &buffer,
                               .signalSemaphoreInfoCount = static_cast<uint32_t>(after.size()),
                               .pSignalSemaphoreInfos = after.data()};
    const profile::Scope scope("submit");
    {
        const auto turn = queue_turn();
        check(vkQueueSubmit2(queue_, 1, &submit, VK_NULL_HANDLE), "submitting work");
    }
    ++submitted_;
    std::erase(open_recordings_, slot.recording_);
    slot.batch().give(*this, submitted_);
    run_retired();
    return submitted_;
}

void GpuDevice::wait(uint64_t value) {
    const VkSemaphoreWaitInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO,
                                   .semaphoreCount = 1,
                                   .pSemaphores = &timeline_,
                                   .pValues = &value};
    const profile::Scope scope("wait for the device");
    constexpr uint64_t timeout_ns = 60'000'000'000;
    check(vkWaitSemaphores(handle_, &info, timeout_ns), "waiting for the device");
    run_retired();
}

std::optional<int64_t> GpuDevice::cpu_ns_of(uint64_t ticks) const {
    if (!calibrates_)
        return std::nullopt;
    const VkCalibratedTimestampInfoEXT clocks[] = {
        {.sType = VK_STRUCTURE_TYPE_CALIBRATED_TIMESTAMP_INFO_EXT,
         .timeDomain = VK_TIME_DOMAIN_DEVICE_EXT},
        {.sType = VK_STRUCTURE_TYPE_CALIBRATED_TIMESTAMP_INFO_EXT,
         .timeDomain = VK_TIME_DOMAIN_CLOCK_MONOTONIC_EXT}};
    uint64_t now[2] = {}, deviation_ns = 0;
    check(vkGetCalibratedTimestampsEXT(handle_, 2, clocks, now, &deviation_ns),
          "reading the clocks");
    const auto behind = static_cast<int64_t>(now[0] - ticks); // small, of either sign
    const double behind_ns =
        static_cast<double>(behind) * static_cast<double>(limits_.timestampPeriod);
    return static_cast<int64_t>(now[1]) - static_cast<int64_t>(behind_ns);
}

void GpuDevice::retire(std::function<void()> destroy, uint64_t bytes) {
    retired_.push_back({recordings_, std::nullopt, std::move(destroy), bytes});
    run_retired();
}

uint64_t GpuDevice::retired_bytes() {
    run_retired();
    uint64_t sum = 0;
    for (const Retired& retired : retired_)
        sum += retired.bytes;
    return sum;
}

uint64_t GpuDevice::passed() const {
    uint64_t value = 0;
    check(vkGetSemaphoreCounterValue(handle_, timeline_, &value), "reading the timeline");
    return value;
}

void GpuDevice::run_retired() {
    if (retired_.empty())
        return;
    uint64_t first_open = recordings_ + 1;
    for (const uint64_t recording : open_recordings_)
        first_open = std::min(first_open, recording);
    const uint64_t now = passed();
    while (!retired_.empty()) {
        Retired& front = retired_.front();
        if (!front.value && front.recordings < first_open)
            front.value = submitted_;
        if (!front.value || *front.value > now)
            break;
        const Retired oldest = std::move(front); // which may hold more to be retired
        retired_.pop_front();
        oldest.destroy();
    }
}

uint64_t GpuDevice::resource_bytes() const {
    uint64_t sum = 0;
    for (const ResourceInfo& resource : resources_)
        if (resource.kind != kStagingKind)
            sum += resource.bytes;
    return sum;
}

VkDeviceMemory GpuDevice::allocate(const VkMemoryRequirements& needs, bool visible, bool cached,
                                   const std::string& name) {
    const VkMemoryPropertyFlags wanted =
        visible ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT
                : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    const VkMemoryPropertyFlags preferred =
        cached ? wanted | VK_MEMORY_PROPERTY_HOST_CACHED_BIT : wanted;
    for (const VkMemoryPropertyFlags flags : {preferred, wanted}) {
        for (uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
            if (!(needs.memoryTypeBits >> i & 1) ||
                (memory_.memoryTypes[i].propertyFlags & flags) != flags)
                continue;
            const VkMemoryAllocateInfo info{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                            .allocationSize = needs.size,
                                            .memoryTypeIndex = i};
            VkDeviceMemory memory = VK_NULL_HANDLE;
            const VkResult result = vkAllocateMemory(handle_, &info, nullptr, &memory);
            if (result == VK_SUCCESS) {
                ++created_.objects;
                ++created_.allocations;
                return memory;
            }
            throw GpuError(fmt::format(
                "graphics device: {} needs {} bytes and the heap of {} bytes does not give them "
                "({})",
                name, needs.size, memory_.memoryHeaps[memory_.memoryTypes[i].heapIndex].size,
                name_of(result)));
        }
    }
    throw GpuError(fmt::format("graphics device: no kind of memory suits {}", name));
}

void GpuDevice::name_object(VkObjectType type, uint64_t handle, const std::string& name) const {
    if (!instance_.has_debug_utils())
        return;
    const VkDebugUtilsObjectNameInfoEXT info{
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT,
        .objectType = type,
        .objectHandle = handle,
        .pObjectName = name.c_str()};
    vkSetDebugUtilsObjectNameEXT(handle_, &info);
}

} // namespace palpate
