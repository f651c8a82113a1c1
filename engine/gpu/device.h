#pragma once

#include <vulkan/vulkan_core.h>

#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/instance.h"

namespace palpate {

struct DeviceOptions {
    // A part of a device's name, or its index in list_devices(); empty chooses the first
    // discrete, integrated, virtual, then CPU device, the engine's own before others unless
    // validation is wanted. The environment variable PALPATE_DEVICE stands in for it.
    std::string select;
    bool validation = false;   // Khronos validation with synchronisation validation
    bool int64_atomics = true; // false: as on a device that lacks them
    // For a window: what its library asks for, and whether a queue family of a device serves it.
    // Devices without these are passed over.
    std::vector<std::string> instance_extensions{}, device_extensions{};
    std::function<bool(VkInstance, VkPhysicalDevice, uint32_t family)> can_present{};
};

// A device that the caller made, for Vulkan 1.3, and destroys after the GpuDevice that uses it.
// Nobody else submits to the queue at the same time.
struct AdoptedDevice {
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    uint32_t queue_family; // which computes
    // The features that the device was made with, with the structures chained to them.
    const VkPhysicalDeviceFeatures2* features;
};

// A semaphore that a submission waits for or signals.
struct SemaphoreUse {
    VkSemaphore semaphore;
    uint64_t value = 0; // of a timeline
    // The stages that wait for it, or that end before it is signalled.
    VkPipelineStageFlags2 stages = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
};

class CommandSlot;
class StagingPool;

// One live image, buffer or pipeline, for `--stats`.
struct ResourceInfo {
    std::string name;
    std::string kind; // "image", "buffer", "pipeline", "staging"
    uint64_t bytes;   // of device memory; 0 for pipelines
};

// A Vulkan device with one queue and one timeline. Declared before everything it must outlive.
class GpuDevice {
 public:
    // Throws GpuError with the reason for each device refused.
    explicit GpuDevice(const DeviceOptions& options);
    // Throws GpuError where the device was made without what the engine needs.
    explicit GpuDevice(const AdoptedDevice& adopted);
    // The same device for another thread: with a queue of its own where the family of the first has
    // two, else the two take turns on one. Images of either may be used by both, one after the
    // other: who comes later waits for done_by() of the work before. Messages of validation are
    // the first's. The first outlives it.
    explicit GpuDevice(GpuDevice& first);
    ~GpuDevice(); // waits for the queue
    GpuDevice(const GpuDevice&) = delete;
    GpuDevice& operator=(const GpuDevice&) = delete;

    const DeviceInfo& info() const { return info_; }
    VkDevice handle() const { return handle_; }
    VkPhysicalDevice physical() const { return physical_; }
    VkInstance instance() const { return instance_.handle(); }
    VkQueue queue() const { return queue_; } // for a window to present with
    // Held while queue() is used, where a second thread may use it, too.
    std::unique_lock<std::mutex> queue_turn() const { return std::unique_lock(*queue_turn_); }
    void wait_idle() const; // until the queue has done all work
    uint32_t queue_family() const { return queue_family_; }
    const VkPhysicalDeviceLimits& limits() const { return limits_; }
    bool can_filter_linearly(VkFormat format) const;
    bool has_int64_atomics() const { return int64_atomics_; } // on storage buffers
    std::vector<std::string> validation_messages() const { return instance_.messages(); }
    bool labels_commands() const { return instance_.labels_commands(); }

    // A slot to record into, and its way back. A slot that was given back is taken again when the
    // timeline has passed its submission. Commands does all this.
    std::unique_ptr<CommandSlot> take_slot();
    // Hands what was recorded to the queue; returns the timeline value it will signal.
    uint64_t submit(CommandSlot& slot, std::span<const SemaphoreUse> waits = {},
                    std::span<const SemaphoreUse> signals = {});
    // `value` is that of the slot's submission; 0 where there was none.
    void give_slot(std::unique_ptr<CommandSlot> slot, uint64_t value);
    // Mapped memory that commands share.
    StagingPool& staging() { return *staging_; }

    // Blocks until the timeline has passed `value`. Throws GpuError when the device is lost, or has
    // not answered for a minute.
    void wait(uint64_t value);
    uint64_t last_submitted() const { return submitted_; }
    // For work on another queue to wait for.
    SemaphoreUse done_by(uint64_t value) const { return {timeline_, value}; }
    uint64_t passed() const; // by the timeline; never waits

    // Runs `destroy`, which frees so many bytes, once the GPU is past everything submitted so far,
    // and past what is being recorded now.
    void retire(std::function<void()> destroy, uint64_t bytes = 0);
    // Bytes of device memory that is retired and not yet freed, staging left out.
    uint64_t retired_bytes();

    // Memory for a resource; `visible` asks for memory the CPU can map. Throws GpuError with both
    // numbers when there is not enough.
    VkDeviceMemory allocate(const VkMemoryRequirements& needs, bool visible, bool cached,
                            const std::string& name);
    void name_object(VkObjectType type, uint64_t handle, const std::string& name) const;

    // Vulkan objects made since the device was, and among them allocations of device memory. A
    // frame like the ones before adds none.
    struct Created {
        uint64_t objects = 0, allocations = 0;
    };
    Created& created() { return created_; }

    // Copies between CPU and GPU since the device was made; Commands counts them. Small blocks that
    // the GPU reads where the CPU wrote them are not copies.
    struct Traffic {
        uint64_t uploads = 0, uploaded_bytes = 0;
        uint64_t read_backs = 0, read_back_bytes = 0;
    };
    Traffic& traffic() { return traffic_; }
    const Traffic& traffic() const { return traffic_; }

    // A timestamp of the GPU in nanoseconds of profile::now_ns(), by VK_EXT_calibrated_timestamps;
    // nothing where the driver lacks it. Good to about the microsecond in which both clocks are
    // read, and asked anew every time, so that clocks that drift do no harm.
    std::optional<int64_t> cpu_ns_of(uint64_t ticks) const;

    // The live resources. A resource registers itself and leaves when dropped.
    using ResourceEntry = std::list<ResourceInfo>::iterator;
    ResourceEntry enter(ResourceInfo info) {
        return resources_.insert(resources_.end(), std::move(info));
    }
    void leave(ResourceEntry entry) { resources_.erase(entry); }
    const std::list<ResourceInfo>& resources() const { return resources_; }
    // Bytes of device memory that resources take, staging left out.
    uint64_t resource_bytes() const;

 private:
    void make_timeline();
    void run_retired();

    Instance instance_;
    DeviceInfo info_;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice handle_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    uint32_t queue_count_ = 1; // that the device was made with
    std::shared_ptr<std::mutex> queue_turn_ = std::make_shared<std::mutex>();
    VkSemaphore timeline_ = VK_NULL_HANDLE;
    VkPhysicalDeviceLimits limits_{};
    VkPhysicalDeviceMemoryProperties memory_{};
    uint32_t queue_family_ = 0;
    uint64_t submitted_ = 0;
    struct Retired {
        uint64_t recordings;           // those numbered so far, which may use it
        std::optional<uint64_t> value; // of the timeline; none while one of them is open
        std::function<void()> destroy;
        uint64_t bytes;
    };
    std::deque<Retired> retired_;
    std::list<ResourceInfo> resources_;
    struct IdleSlot {
        std::unique_ptr<CommandSlot> slot;
        uint64_t value;
    };
    std::deque<IdleSlot> idle_slots_; // by value
    std::unique_ptr<StagingPool> staging_;
    uint64_t recordings_ = 0;               // numbers given so far
    std::vector<uint64_t> open_recordings_; // neither submitted nor given back
    Traffic traffic_;
    Created created_;
    bool owned_ = true;
    bool calibrates_ = false; // the driver tells its clock beside ours
    bool int64_atomics_ = false;
};

} // namespace palpate
