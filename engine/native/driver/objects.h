#pragma once

// The objects behind the driver's handles. Handles are addresses of these.

#include <fmt/format.h>

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "engine/native/driver/commands.h"
#include "engine/native/kernel.h"

namespace palpate::native::driver {

// The first word of a handle that a loader dispatches by.
struct Dispatchable {
    const void* word = first_word();
    static const void* first_word();
};

struct Instance : Dispatchable {};
struct Physical : Dispatchable {};
struct Messenger {}; // which hears nothing: the driver's complaints go to standard error

// Writes why a call fails.
void complain(const std::string& sentence);
template <class... Args>
VkResult refuse(fmt::format_string<Args...> format, Args&&... args) {
    complain(fmt::format(format, std::forward<Args>(args)...));
    return VK_ERROR_FEATURE_NOT_PRESENT;
}

// Bytes before and behind the texels of an image that may be read, too.
constexpr uint64_t kGuardBytes = 64;

uint64_t allocated_bytes();        // of device memory, by all devices
uint64_t available_memory_bytes(); // that the system says a process may still have

struct Memory {
    std::unique_ptr<std::byte, void (*)(void*)> bytes{nullptr, nullptr};
    uint64_t size = 0;
};

struct Buffer {
    uint64_t size = 0;
    std::byte* data = nullptr; // null until memory is bound
};

// Texels lie tight, x fastest, then y, then slices, then layers.
struct Image {
    VkImageType type = VK_IMAGE_TYPE_2D;
    VkFormat format = VK_FORMAT_UNDEFINED;
    VkExtent3D size{};
    uint32_t layers = 1;
    std::byte* texels = nullptr; // null until memory is bound

    uint64_t row_bytes() const { return uint64_t{size.width} * texel_bytes(format); }
    uint64_t slice_bytes() const { return row_bytes() * size.height; }
    uint64_t layer_bytes() const { return slice_bytes() * size.depth; }
    uint64_t bytes() const { return layer_bytes() * layers; }
};

struct ImageView {
    native::Image image;
};

struct SetLayout {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
};

struct DescriptorSet {
    struct Slot {
        uint32_t binding = 0;
        VkDescriptorType type{};
        bool is_written = false;
        Resource resource;
    };
    std::vector<Slot> slots;
    bool is_taken = false;
};

struct DescriptorPool {
    std::vector<std::unique_ptr<DescriptorSet>> sets; // as many as were ever taken at once
    uint32_t most_sets = 0, taken_sets = 0;
    std::vector<VkDescriptorPoolSize> most, taken; // by type, in the same order
    void give(DescriptorSet& set);
};

struct PipelineLayout {
    uint32_t sets = 0, push_constant_bytes = 0;
};

struct ShaderModule {
    uint64_t hash = 0;
};

struct Pipeline {
    const Kernel* kernel = nullptr;  // null: draws triangles of the interface
    std::vector<uint32_t> constants; // of Kernel::constants
};

// Guarded by the device's monitor, like semaphores and fences.
struct QueryPool {
    struct Query {
        uint64_t value = 0;
        bool is_available = false;
    };
    std::vector<Query> queries;
};

struct Semaphore {
    bool is_timeline = false;
    uint64_t value = 0; // of a binary one: 1 while it is signalled
};

struct Fence {
    bool is_signalled = false;
};

struct SemaphoreValue {
    Semaphore* semaphore = nullptr;
    uint64_t value = 0;
};

struct Submission {
    std::vector<SemaphoreValue> waits, signals;
    std::vector<CommandBuffer*> commands;
    Fence* fence = nullptr;
};

struct Device;

// Does its submissions one after the other on a thread of its own, with the help of oneTBB's.
struct Queue : Dispatchable {
    explicit Queue(Device& device);
    ~Queue(); // does what was submitted
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    void submit(std::vector<Submission> submissions);
    void wait_idle();

 private:
    void work();
    void finish(const Submission& done);

    Device* device_;
    std::deque<Submission> pending_;
    bool is_busy_ = false, stops_ = false;
    std::thread thread_;
};

constexpr uint32_t kQueues = 2; // one for pictures, one for an interface beside them

struct Device : Dispatchable {
    // Everything that one thread waits for and another brings about.
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<std::unique_ptr<Queue>> queues;
};

struct CommandPool {
    std::vector<std::unique_ptr<CommandBuffer>> buffers;
};

// State that triangles are drawn with.
struct Drawing {
    native::Image target; // without texels outside of vkCmdBeginRendering and its end
    const Pipeline* pipeline = nullptr;
    const DescriptorSet* set = nullptr;
    VkRect2D scissor{};
    const Buffer *vertices = nullptr, *indices = nullptr;
    uint64_t vertex_offset = 0, index_offset = 0;
    bool has_long_indices = false;
};

struct CommandBuffer : Dispatchable {
    std::vector<Command> commands;
    std::string failure; // the first; empty if all commands were recorded
    const Pipeline* pipeline = nullptr;
    std::array<const DescriptorSet*, 4> sets{};
    std::array<std::byte, 128> push_constants{};
    Drawing drawing;

    void reset();
    void fail(const std::string& sentence);
};

// Adds what `make` returns.
template <class Make>
void record(CommandBuffer& buffer, Make make) {
    try {
        buffer.commands.emplace_back(make());
    } catch (const std::bad_alloc&) {
        buffer.failure = "the host's memory is used up";
    }
}

void execute(const DrawTriangles& command);
void execute(const ClearRectangles& command);
// Executes what was recorded, in order.
void execute(Device& device, const CommandBuffer& buffer);

// Nanoseconds of CLOCK_MONOTONIC, which timestamps count in.
uint64_t clock_ns();

template <class T, class Handle>
T* of(Handle handle) {
    return reinterpret_cast<T*>(handle);
}
template <class Handle, class T>
Handle handle_of(T* object) {
    return reinterpret_cast<Handle>(object);
}

// Makes an object by `make`, whose failures of the host become Vulkan's.
template <class Handle, class Make>
VkResult create(Handle* out, Make make) {
    try {
        *out = reinterpret_cast<Handle>(make().release());
        return VK_SUCCESS;
    } catch (const std::bad_alloc&) {
        return VK_ERROR_OUT_OF_HOST_MEMORY;
    } catch (const std::system_error&) { // no thread
        return VK_ERROR_INITIALIZATION_FAILED;
    }
}

} // namespace palpate::native::driver
