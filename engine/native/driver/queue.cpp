// Devices, queues, and what threads wait for: semaphores, fences and queries.

#include <algorithm>
#include <chrono>
#include <cstring>

#include "engine/native/driver/api.h"
#include "engine/native/driver/features.h"
#include "engine/native/driver/objects.h"

namespace palpate::native::driver {

namespace {

// Waits with the device's lock held until `done`; false after so many nanoseconds.
template <class Done>
bool wait_for(Device& device, std::unique_lock<std::mutex>& lock, uint64_t timeout_ns, Done done) {
    constexpr uint64_t kLongest_ns = uint64_t{1} << 60; // half a life; a deadline must not overflow
    if (timeout_ns >= kLongest_ns) {
        device.changed.wait(lock, done);
        return true;
    }
    return device.changed.wait_for(lock, std::chrono::nanoseconds(timeout_ns), done);
}

// A binary semaphore is signalled at 1.
uint64_t wanted_value(const SemaphoreValue& wait) {
    return wait.semaphore->is_timeline ? wait.value : 1;
}

bool has_passed(const SemaphoreValue& wait) {
    return wait.semaphore->value >= wanted_value(wait);
}

std::vector<SemaphoreValue> values_of(const VkSemaphoreSubmitInfo* infos, uint32_t count) {
    std::vector<SemaphoreValue> values;
    for (uint32_t i = 0; i < count; ++i)
        values.push_back({of<Semaphore>(infos[i].semaphore), infos[i].value});
    return values;
}

Submission submission_of(const VkSubmitInfo2& info) {
    Submission made;
    made.waits = values_of(info.pWaitSemaphoreInfos, info.waitSemaphoreInfoCount);
    made.signals = values_of(info.pSignalSemaphoreInfos, info.signalSemaphoreInfoCount);
    for (uint32_t i = 0; i < info.commandBufferInfoCount; ++i)
        made.commands.push_back(of<CommandBuffer>(info.pCommandBufferInfos[i].commandBuffer));
    return made;
}

} // namespace

Queue::Queue(Device& device) : device_(&device), thread_([this] { work(); }) {}

Queue::~Queue() {
    {
        const std::scoped_lock lock(device_->mutex);
        stops_ = true;
    }
    device_->changed.notify_all();
    thread_.join();
}

void Queue::submit(std::vector<Submission> submissions) {
    {
        const std::scoped_lock lock(device_->mutex);
        for (Submission& submission : submissions)
            pending_.push_back(std::move(submission));
    }
    device_->changed.notify_all();
}

void Queue::wait_idle() {
    std::unique_lock lock(device_->mutex);
    device_->changed.wait(lock, [&] { return pending_.empty() && !is_busy_; });
}

void Queue::work() {
    std::unique_lock lock(device_->mutex);
    for (;;) {
        device_->changed.wait(lock, [&] { return stops_ || !pending_.empty(); });
        if (pending_.empty())
            return;
        const Submission now = std::move(pending_.front());
        pending_.pop_front();
        is_busy_ = true;
        device_->changed.wait(
            lock, [&] { return std::all_of(now.waits.begin(), now.waits.end(), has_passed); });
        for (const SemaphoreValue& wait : now.waits)
            if (!wait.semaphore->is_timeline)
                wait.semaphore->value = 0;
        lock.unlock();
        for (const CommandBuffer* commands : now.commands)
            execute(*device_, *commands);
        lock.lock();
        is_busy_ = false;
        finish(now);
    }
}

void Queue::finish(const Submission& done) {
    for (const SemaphoreValue& signal : done.signals)
        signal.semaphore->value = wanted_value(signal);
    if (done.fence)
        done.fence->is_signalled = true;
    device_->changed.notify_all();
}

namespace api {

VkResult vkCreateDevice(VkPhysicalDevice, const VkDeviceCreateInfo* info,
                        const VkAllocationCallbacks*, VkDevice* out) {
    if (const std::string why = feature_refusal(*info); !why.empty())
        return refuse("vkCreateDevice: {} is not there", why);
    for (uint32_t i = 0; i < info->enabledExtensionCount; ++i) {
        const char* name = info->ppEnabledExtensionNames[i];
        if (std::strcmp(name, VK_EXT_CALIBRATED_TIMESTAMPS_EXTENSION_NAME) != 0 &&
            std::strcmp(name, VK_EXT_MEMORY_BUDGET_EXTENSION_NAME) != 0) {
            complain(fmt::format("vkCreateDevice: the extension {} is not there", name));
            return VK_ERROR_EXTENSION_NOT_PRESENT;
        }
    }
    return create(out, [&] {
        auto device = std::make_unique<Device>();
        for (uint32_t i = 0; i < kQueues; ++i)
            device->queues.push_back(std::make_unique<Queue>(*device));
        return device;
    });
}

void vkDestroyDevice(VkDevice device, const VkAllocationCallbacks*) {
    delete of<Device>(device);
}

void vkGetDeviceQueue(VkDevice device, uint32_t, uint32_t index, VkQueue* out) {
    *out = handle_of<VkQueue>(of<Device>(device)->queues.at(index).get());
}

VkResult vkDeviceWaitIdle(VkDevice device) {
    for (const auto& queue : of<Device>(device)->queues)
        queue->wait_idle();
    return VK_SUCCESS;
}

VkResult vkQueueWaitIdle(VkQueue queue) {
    of<Queue>(queue)->wait_idle();
    return VK_SUCCESS;
}

VkResult vkQueueSubmit2(VkQueue queue, uint32_t count, const VkSubmitInfo2* infos, VkFence fence) {
    try {
        std::vector<Submission> submissions;
        for (uint32_t i = 0; i < count; ++i)
            submissions.push_back(submission_of(infos[i]));
        if (fence && submissions.empty())
            submissions.emplace_back();
        if (fence)
            submissions.back().fence = of<Fence>(fence);
        of<Queue>(queue)->submit(std::move(submissions));
        return VK_SUCCESS;
    } catch (const std::bad_alloc&) {
        return VK_ERROR_OUT_OF_HOST_MEMORY;
    }
}

VkResult vkCreateSemaphore(VkDevice, const VkSemaphoreCreateInfo* info,
                           const VkAllocationCallbacks*, VkSemaphore* out) {
    Semaphore semaphore;
    for (auto* next = static_cast<const VkBaseInStructure*>(info->pNext); next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO) {
            const auto& type = *reinterpret_cast<const VkSemaphoreTypeCreateInfo*>(next);
            semaphore = {type.semaphoreType == VK_SEMAPHORE_TYPE_TIMELINE, type.initialValue};
        }
    return create(out, [&] { return std::make_unique<Semaphore>(semaphore); });
}

void vkDestroySemaphore(VkDevice, VkSemaphore semaphore, const VkAllocationCallbacks*) {
    delete of<Semaphore>(semaphore);
}

VkResult vkGetSemaphoreCounterValue(VkDevice device, VkSemaphore semaphore, uint64_t* out) {
    const std::scoped_lock lock(of<Device>(device)->mutex);
    *out = of<Semaphore>(semaphore)->value;
    return VK_SUCCESS;
}

VkResult vkSignalSemaphore(VkDevice device, const VkSemaphoreSignalInfo* info) {
    {
        const std::scoped_lock lock(of<Device>(device)->mutex);
        of<Semaphore>(info->semaphore)->value = info->value;
    }
    of<Device>(device)->changed.notify_all();
    return VK_SUCCESS;
}

VkResult vkWaitSemaphores(VkDevice device, const VkSemaphoreWaitInfo* info, uint64_t timeout_ns) {
    std::unique_lock lock(of<Device>(device)->mutex);
    const auto passed = [&](uint32_t i) {
        return of<Semaphore>(info->pSemaphores[i])->value >= info->pValues[i];
    };
    const auto done = [&] {
        const bool any = (info->flags & VK_SEMAPHORE_WAIT_ANY_BIT) != 0;
        for (uint32_t i = 0; i < info->semaphoreCount; ++i)
            if (passed(i) == any)
                return any;
        return !any;
    };
    return wait_for(*of<Device>(device), lock, timeout_ns, done) ? VK_SUCCESS : VK_TIMEOUT;
}

VkResult vkCreateFence(VkDevice, const VkFenceCreateInfo* info, const VkAllocationCallbacks*,
                       VkFence* out) {
    const Fence fence{(info->flags & VK_FENCE_CREATE_SIGNALED_BIT) != 0};
    return create(out, [&] { return std::make_unique<Fence>(fence); });
}

void vkDestroyFence(VkDevice, VkFence fence, const VkAllocationCallbacks*) {
    delete of<Fence>(fence);
}

VkResult vkResetFences(VkDevice device, uint32_t count, const VkFence* fences) {
    const std::scoped_lock lock(of<Device>(device)->mutex);
    for (uint32_t i = 0; i < count; ++i)
        of<Fence>(fences[i])->is_signalled = false;
    return VK_SUCCESS;
}

VkResult vkGetFenceStatus(VkDevice device, VkFence fence) {
    const std::scoped_lock lock(of<Device>(device)->mutex);
    return of<Fence>(fence)->is_signalled ? VK_SUCCESS : VK_NOT_READY;
}

VkResult vkWaitForFences(VkDevice device, uint32_t count, const VkFence* fences, VkBool32 all,
                         uint64_t timeout_ns) {
    std::unique_lock lock(of<Device>(device)->mutex);
    const auto done = [&] {
        const auto is_signalled = [](VkFence fence) { return of<Fence>(fence)->is_signalled; };
        return all ? std::all_of(fences, fences + count, is_signalled)
                   : std::any_of(fences, fences + count, is_signalled);
    };
    return wait_for(*of<Device>(device), lock, timeout_ns, done) ? VK_SUCCESS : VK_TIMEOUT;
}

VkResult vkCreateQueryPool(VkDevice, const VkQueryPoolCreateInfo* info,
                           const VkAllocationCallbacks*, VkQueryPool* out) {
    if (info->queryType != VK_QUERY_TYPE_TIMESTAMP)
        return refuse("vkCreateQueryPool: expected timestamps, found type {}",
                      static_cast<int>(info->queryType));
    return create(out, [&] {
        auto pool = std::make_unique<QueryPool>();
        pool->queries.resize(info->queryCount);
        return pool;
    });
}

void vkDestroyQueryPool(VkDevice, VkQueryPool pool, const VkAllocationCallbacks*) {
    delete of<QueryPool>(pool);
}

VkResult vkGetQueryPoolResults(VkDevice device, VkQueryPool pool, uint32_t first, uint32_t count,
                               size_t, void* data, VkDeviceSize stride, VkQueryResultFlags flags) {
    if (!(flags & VK_QUERY_RESULT_64_BIT))
        return refuse("vkGetQueryPoolResults: expected 64 bits a timestamp, found 32");
    std::unique_lock lock(of<Device>(device)->mutex);
    const auto from = of<QueryPool>(pool)->queries.begin() + first;
    const auto all_there = [&] {
        return std::all_of(from, from + count, [](const auto& q) { return q.is_available; });
    };
    if (flags & VK_QUERY_RESULT_WAIT_BIT)
        of<Device>(device)->changed.wait(lock, all_there);
    for (uint32_t i = 0; i < count; ++i) {
        const QueryPool::Query& query = from[i];
        auto* to = static_cast<std::byte*>(data) + i * stride;
        if (query.is_available)
            std::memcpy(to, &query.value, sizeof query.value);
        const uint64_t is_available = query.is_available;
        if (flags & VK_QUERY_RESULT_WITH_AVAILABILITY_BIT)
            std::memcpy(to + sizeof query.value, &is_available, sizeof is_available);
    }
    return all_there() ? VK_SUCCESS : VK_NOT_READY;
}

VkResult vkGetCalibratedTimestampsEXT(VkDevice, uint32_t count, const VkCalibratedTimestampInfoEXT*,
                                      uint64_t* out, uint64_t* most_deviation_ns) {
    std::fill_n(out, count, clock_ns()); // the device's clock is the host's
    *most_deviation_ns = 0;
    return VK_SUCCESS;
}

} // namespace api
} // namespace palpate::native::driver
