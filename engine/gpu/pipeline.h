#pragma once

#include <vulkan/vulkan_core.h>

#include <cstdint>
#include <future>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "engine/gpu/device.h"
#include "engine/gpu/shader.h"

namespace palpate {

// One compute shader with its constants. Creating it takes 1 to 200 ms, on a thread of its own:
// handle() waits for it, and fails as it did. Its first dispatch may take more: drivers compile
// then.
class ComputePipeline {
 public:
    ComputePipeline(GpuDevice& device, const Shader& shader);
    ~ComputePipeline();
    ComputePipeline(const ComputePipeline&) = delete;
    ComputePipeline& operator=(const ComputePipeline&) = delete;

    VkPipeline handle() const;
    VkPipelineLayout layout() const { return layout_; }
    VkDescriptorSetLayout set_layout() const { return set_layout_; }
    std::span<const BindingSlot> slots() const { return slots_; }
    const std::string& name() const { return name_; }
    // True once: for the dispatch in which the driver may compile.
    bool take_first_use() const { return std::exchange(unused_, false); }
    // Time of its creation, and the part of it that handle() waited; 0 before handle().
    double creation_ms() const { return creation_ms_; }
    double wait_ms() const { return wait_ms_; }

 private:
    GpuDevice* device_;
    std::string name_;
    mutable bool unused_ = true;
    std::span<const BindingSlot> slots_;
    VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    struct Created {
        VkPipeline handle;
        double ms;
    };
    std::shared_future<Created> creation_;
    mutable VkPipeline handle_ = VK_NULL_HANDLE;
    mutable double creation_ms_ = 0, wait_ms_ = 0;
    GpuDevice::ResourceEntry entry_;
};

// Makes each pipeline when it is first asked for, once: what is asked for before work of other
// kinds is ready after it.
class PipelineCache {
 public:
    explicit PipelineCache(GpuDevice& device) : device_(&device) {}

    ComputePipeline& get(const Shader& shader);

    double creation_ms() const; // spent so far, on threads beside each other
    double wait_ms() const;     // of that, what was waited for

 private:
    GpuDevice* device_;
    std::map<Shader, ComputePipeline> made_;
};

} // namespace palpate
