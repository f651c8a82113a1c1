#include "engine/gpu/command_slot.h"

#include <volk.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "engine/base/assert.h"
#include "engine/gpu/error.h"

namespace palpate {

namespace {

// Alignment of the offsets of bindings and copies: no device asks for more.
constexpr uint64_t kAlignment = 256;

// Sizes of staging buffers are multiples of this: the blocks of a frame and the bricks of an edit,
// 32 of them with 16 bits a sample, fit the smallest.
constexpr uint64_t kStagingStep = uint64_t{4} << 20;
constexpr uint64_t kKeptSubmissions = 64;

// Sets of one descriptor pool, and how many descriptors of each kind a set has on average.
constexpr uint32_t kSetsPerPool = 64;
constexpr VkDescriptorPoolSize kDescriptors[] = {
    {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 2 * kSetsPerPool},
    {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 8 * kSetsPerPool},
    {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 8 * kSetsPerPool},
    {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 4 * kSetsPerPool}};

} // namespace

CommandSlot::CommandSlot(GpuDevice& device) : device_(&device) {
    const VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                       .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                       .queueFamilyIndex = device.queue_family()};
    check(vkCreateCommandPool(device.handle(), &pool, nullptr, &pool_), "creating a command pool");
    const VkCommandBufferAllocateInfo allocate{
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = pool_,
        .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = 1};
    check(vkAllocateCommandBuffers(device.handle(), &allocate, &commands_), "allocating commands");
    const VkQueryPoolCreateInfo queries{.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                        .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                        .queryCount = 2 * kMaxPasses};
    check(vkCreateQueryPool(device.handle(), &queries, nullptr, &queries_), "creating timestamps");
    device.created().objects += 3;
    add_descriptor_pool();
}

CommandSlot::~CommandSlot() {
    for (const VkDescriptorPool pool : descriptor_pools_)
        vkDestroyDescriptorPool(device_->handle(), pool, nullptr);
    vkDestroyQueryPool(device_->handle(), queries_, nullptr);
    vkDestroyCommandPool(device_->handle(), pool_, nullptr);
}

void CommandSlot::begin() {
    check(vkResetCommandPool(device_->handle(), pool_, 0), "resetting commands");
    for (size_t i = 0; i <= descriptor_pool_; ++i)
        check(vkResetDescriptorPool(device_->handle(), descriptor_pools_[i], 0),
              "resetting bindings");
    descriptor_pool_ = 0;
    const VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                         .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    check(vkBeginCommandBuffer(commands_, &begin), "beginning commands");
    vkCmdResetQueryPool(commands_, queries_, 0, 2 * kMaxPasses);
}

void CommandSlot::add_descriptor_pool() {
    const VkDescriptorPoolCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
        .maxSets = kSetsPerPool,
        .poolSizeCount = static_cast<uint32_t>(std::size(kDescriptors)),
        .pPoolSizes = kDescriptors};
    VkDescriptorPool pool = VK_NULL_HANDLE;
    check(vkCreateDescriptorPool(device_->handle(), &create, nullptr, &pool), "creating bindings");
    ++device_->created().objects;
    descriptor_pools_.push_back(pool);
}

VkDescriptorSet CommandSlot::take_set(VkDescriptorSetLayout layout) {
    for (;;) {
        const VkDescriptorSetAllocateInfo allocate{
            .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
            .descriptorPool = descriptor_pools_[descriptor_pool_],
            .descriptorSetCount = 1,
            .pSetLayouts = &layout};
        VkDescriptorSet set = VK_NULL_HANDLE;
        const VkResult result = vkAllocateDescriptorSets(device_->handle(), &allocate, &set);
        const bool full =
            result == VK_ERROR_OUT_OF_POOL_MEMORY || result == VK_ERROR_FRAGMENTED_POOL;
        if (!full) {
            check(result, "allocating bindings");
            return set;
        }
        if (++descriptor_pool_ == descriptor_pools_.size())
            add_descriptor_pool();
    }
}

BufferSlice Staging::take(GpuDevice& device, uint64_t bytes) {
    PALPATE_ASSERT(bytes > 0);
    if (buffers_.empty() || used_ + bytes > buffers_.back()->bytes()) {
        buffers_.push_back(device.staging().take(device, memory_, bytes));
        used_ = 0;
    }
    const BufferSlice slice(*buffers_.back(), used_, bytes);
    used_ = (used_ + bytes + kAlignment - 1) / kAlignment * kAlignment;
    return slice;
}

void Staging::give(GpuDevice& device, uint64_t value) {
    for (std::unique_ptr<Buffer>& buffer : buffers_)
        device.staging().give(std::move(buffer), memory_, value);
    buffers_.clear();
}

std::unique_ptr<Buffer> StagingPool::take(GpuDevice& device, Memory memory, uint64_t bytes) {
    const uint64_t passed = device.passed();
    std::erase_if(idle_, [&](const Idle& idle) { return idle.value + kKeptSubmissions < passed; });
    auto smallest = idle_.end();
    for (auto idle = idle_.begin(); idle != idle_.end(); ++idle)
        if (idle->memory == memory && idle->value <= passed && idle->buffer->bytes() >= bytes &&
            (smallest == idle_.end() || idle->buffer->bytes() < smallest->buffer->bytes()))
            smallest = idle;
    if (smallest == idle_.end())
        return std::make_unique<Buffer>(
            device, memory == Memory::upload ? "uploads on their way" : "read-backs on their way",
            (bytes + kStagingStep - 1) / kStagingStep * kStagingStep, memory, kStagingKind);
    std::unique_ptr<Buffer> found = std::move(smallest->buffer);
    idle_.erase(smallest);
    return found;
}

void StagingPool::give(std::unique_ptr<Buffer> buffer, Memory memory, uint64_t value) {
    idle_.push_back({std::move(buffer), memory, value});
}

} // namespace palpate
