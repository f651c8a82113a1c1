#pragma once

#include <vulkan/vulkan_core.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "engine/gpu/resource.h"

namespace palpate {

// Mapped buffers that are used again once the device is past what used them. A buffer that 64
// submissions did not use is freed.
class StagingPool {
 public:
    // A buffer of at least `bytes`.
    std::unique_ptr<Buffer> take(GpuDevice& device, Memory memory, uint64_t bytes);
    // Usable again when the timeline has passed `value`.
    void give(std::unique_ptr<Buffer> buffer, Memory memory, uint64_t value);

 private:
    struct Idle {
        std::unique_ptr<Buffer> buffer;
        Memory memory;
        uint64_t value;
    };
    std::deque<Idle> idle_;
};

// Slices of mapped memory, taken for some submissions and given back together.
class Staging {
 public:
    // `memory` is not Memory::device.
    explicit Staging(Memory memory) : memory_(memory) {}
    // bytes > 0. Slices start at multiples of 256 bytes, as bindings and copies want it.
    BufferSlice take(GpuDevice& device, uint64_t bytes);
    // To the device's pool; the timeline will have passed `value` when nothing uses them any more.
    void give(GpuDevice& device, uint64_t value);

 private:
    Memory memory_;
    uint64_t used_ = 0; // of the last buffer
    std::vector<std::unique_ptr<Buffer>> buffers_;
};

// The timestamps of one slot: two for each pass. More passes take another submission.
constexpr uint32_t kMaxPasses = 64;

// The recyclable objects of one submission: command buffer, timestamps, descriptor sets. GpuDevice
// gives a slot out again once the device is past its submission, so that frames create nothing.
class CommandSlot {
 public:
    explicit CommandSlot(GpuDevice& device);
    ~CommandSlot(); // the device is past its submission
    CommandSlot(const CommandSlot&) = delete;
    CommandSlot& operator=(const CommandSlot&) = delete;

    // Empties the slot and begins its command buffer.
    void begin();

    VkCommandBuffer commands() const { return commands_; }
    VkQueryPool queries() const { return queries_; } // 2 * kMaxPasses timestamps
    VkDescriptorSet take_set(VkDescriptorSetLayout layout);
    Staging& batch() { return batch_; } // for this submission alone

 private:
    friend class GpuDevice;
    void add_descriptor_pool();

    GpuDevice* device_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    VkQueryPool queries_ = VK_NULL_HANDLE;
    std::vector<VkDescriptorPool> descriptor_pools_;
    size_t descriptor_pool_ = 0; // the one that sets are taken from
    Staging batch_{Memory::upload};
    uint64_t recording_ = 0; // GpuDevice numbers what is recorded
};

} // namespace palpate
