#pragma once

#include <volk.h>

#include <atomic>
#include <tuple>
#include <type_traits>

namespace palpate {

// Counts the calls of a Vulkan function for as long as this lives: stands in for the pointer that
// volk loaded.
template <auto& function, class Type = std::remove_reference_t<decltype(function)>>
class Calls;
template <auto& function, class Returned, class... Arguments>
class Calls<function, Returned(VKAPI_PTR*)(Arguments...)> {
 public:
    Calls() : original_(function) {
        count_ = 0;
        in_place_ = original_;
        function = counted;
    }
    ~Calls() { function = original_; }
    Calls(const Calls&) = delete;
    Calls& operator=(const Calls&) = delete;
    static uint64_t count() { return count_; }

 private:
    using Function = Returned(VKAPI_PTR*)(Arguments...);
    static VKAPI_ATTR Returned VKAPI_CALL counted(Arguments... arguments) {
        ++count_;
        return in_place_(arguments...);
    }
    Function original_;
    static inline Function in_place_ = nullptr;
    static inline std::atomic<uint64_t> count_ = 0;
};

// Counts all calls that make Vulkan objects but instance and device, and that allocate memory. It
// does not ask the engine's own counters (GpuDevice::created()), which are checked by it.
class CreatedObjects {
 public:
    uint64_t count() const {
        return std::apply([](const auto&... calls) { return (calls.count() + ...); }, calls_);
    }
    uint64_t allocations() const { return std::get<0>(calls_).count(); }

 private:
    std::tuple<Calls<vkAllocateMemory>, Calls<vkAllocateCommandBuffers>, Calls<vkCreateBuffer>,
               Calls<vkCreateBufferView>, Calls<vkCreateImage>, Calls<vkCreateImageView>,
               Calls<vkCreateSampler>, Calls<vkCreateSemaphore>, Calls<vkCreateFence>,
               Calls<vkCreateEvent>, Calls<vkCreateQueryPool>, Calls<vkCreateCommandPool>,
               Calls<vkCreateDescriptorPool>, Calls<vkCreateDescriptorSetLayout>,
               Calls<vkCreatePipelineLayout>, Calls<vkCreatePipelineCache>,
               Calls<vkCreateShaderModule>, Calls<vkCreateComputePipelines>,
               Calls<vkCreateGraphicsPipelines>, Calls<vkCreateRenderPass>,
               Calls<vkCreateFramebuffer>>
        calls_;
};

} // namespace palpate
