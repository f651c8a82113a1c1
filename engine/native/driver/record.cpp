// Command buffers: what the calls that record leave in them. A command that cannot be recorded
// fails its buffer: vkEndCommandBuffer then says so.

#include <algorithm>
#include <cstring>

#include "engine/native/driver/api.h"
#include "engine/native/driver/objects.h"
#include "engine/native/driver/texel.h"

namespace palpate::native::driver {

namespace {

template <class Make>
void record(VkCommandBuffer handle, Make make) {
    driver::record(*of<CommandBuffer>(handle), make);
}

const DescriptorSet::Slot* slot_of(const CommandBuffer& buffer, const Binding& binding) {
    const DescriptorSet* set =
        binding.set < buffer.sets.size() ? buffer.sets[binding.set] : nullptr;
    if (!set)
        return nullptr;
    const auto found = std::find_if(set->slots.begin(), set->slots.end(), [&](const auto& slot) {
        return slot.binding == binding.binding && slot.type == binding.type;
    });
    return found != set->slots.end() && found->is_written ? &*found : nullptr;
}

void dispatch(VkCommandBuffer handle, std::array<uint32_t, 3> first, std::array<uint32_t, 3> groups,
              const Buffer* indirect, uint64_t offset) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    if (!buffer.pipeline)
        return buffer.fail("a dispatch: no pipeline is bound");
    const Kernel& kernel = *buffer.pipeline->kernel;
    record(handle, [&] {
        Dispatch made{buffer.pipeline, {}, buffer.push_constants, first, groups, indirect, offset};
        for (const Binding& binding : kernel.bindings) {
            const DescriptorSet::Slot* slot = binding.is_used ? slot_of(buffer, binding) : nullptr;
            if (slot) {
                made.resources.push_back(slot->resource);
                continue;
            }
            made.resources.push_back({});
            if (!binding.is_used)
                continue;
            buffer.fail(fmt::format(
                "{}: expected a descriptor of type {} at binding {} of set {}, found "
                "none",
                kernel.name, static_cast<int>(binding.type), binding.binding, binding.set));
        }
        return made;
    });
}

} // namespace

void CommandBuffer::reset() {
    commands.clear();
    failure.clear();
    pipeline = nullptr;
    sets = {};
    push_constants = {};
    drawing = {};
}

void CommandBuffer::fail(const std::string& sentence) {
    complain(sentence);
    if (failure.empty())
        failure = sentence;
}

namespace api {

VkResult vkCreateCommandPool(VkDevice, const VkCommandPoolCreateInfo*, const VkAllocationCallbacks*,
                             VkCommandPool* out) {
    return create(out, [] { return std::make_unique<CommandPool>(); });
}

void vkDestroyCommandPool(VkDevice, VkCommandPool pool, const VkAllocationCallbacks*) {
    delete of<CommandPool>(pool);
}

VkResult vkResetCommandPool(VkDevice, VkCommandPool pool, VkCommandPoolResetFlags) {
    for (const auto& buffer : of<CommandPool>(pool)->buffers)
        buffer->reset();
    return VK_SUCCESS;
}

VkResult vkAllocateCommandBuffers(VkDevice, const VkCommandBufferAllocateInfo* info,
                                  VkCommandBuffer* out) {
    if (info->level != VK_COMMAND_BUFFER_LEVEL_PRIMARY)
        return refuse("vkAllocateCommandBuffers: secondary command buffers are not there");
    std::vector<std::unique_ptr<CommandBuffer>>& buffers =
        of<CommandPool>(info->commandPool)->buffers;
    try {
        for (uint32_t i = 0; i < info->commandBufferCount; ++i) {
            buffers.push_back(std::make_unique<CommandBuffer>());
            out[i] = handle_of<VkCommandBuffer>(buffers.back().get());
        }
        return VK_SUCCESS;
    } catch (const std::bad_alloc&) {
        return VK_ERROR_OUT_OF_HOST_MEMORY;
    }
}

void vkFreeCommandBuffers(VkDevice, VkCommandPool pool, uint32_t count,
                          const VkCommandBuffer* buffers) {
    for (uint32_t i = 0; i < count; ++i)
        std::erase_if(of<CommandPool>(pool)->buffers, [&](const auto& buffer) {
            return buffer.get() == of<CommandBuffer>(buffers[i]);
        });
}

VkResult vkBeginCommandBuffer(VkCommandBuffer buffer, const VkCommandBufferBeginInfo*) {
    of<CommandBuffer>(buffer)->reset();
    return VK_SUCCESS;
}

VkResult vkEndCommandBuffer(VkCommandBuffer buffer) {
    return of<CommandBuffer>(buffer)->failure.empty() ? VK_SUCCESS : VK_ERROR_FEATURE_NOT_PRESENT;
}

void vkCmdBindPipeline(VkCommandBuffer handle, VkPipelineBindPoint point, VkPipeline pipeline) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    const bool draws = point == VK_PIPELINE_BIND_POINT_GRAPHICS;
    (draws ? buffer.drawing.pipeline : buffer.pipeline) = of<Pipeline>(pipeline);
}

void vkCmdBindDescriptorSets(VkCommandBuffer handle, VkPipelineBindPoint point, VkPipelineLayout,
                             uint32_t first, uint32_t count, const VkDescriptorSet* sets,
                             uint32_t dynamic_offsets, const uint32_t*) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    const bool draws = point == VK_PIPELINE_BIND_POINT_GRAPHICS;
    if (dynamic_offsets > 0 || first + count > (draws ? 1 : buffer.sets.size()))
        return buffer.fail(
            "vkCmdBindDescriptorSets: expected sets 0 to 3, or set 0 of triangles, without dynamic "
            "offsets");
    if (draws) {
        buffer.drawing.set = of<DescriptorSet>(sets[0]);
        return;
    }
    for (uint32_t i = 0; i < count; ++i)
        buffer.sets[first + i] = of<DescriptorSet>(sets[i]);
}

void vkCmdPushConstants(VkCommandBuffer handle, VkPipelineLayout, VkShaderStageFlags,
                        uint32_t offset, uint32_t size, const void* values) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    if (offset + size > buffer.push_constants.size())
        return buffer.fail("vkCmdPushConstants: more than 128 bytes");
    std::memcpy(buffer.push_constants.data() + offset, values, size);
}

void vkCmdDispatch(VkCommandBuffer buffer, uint32_t x, uint32_t y, uint32_t z) {
    dispatch(buffer, {}, {x, y, z}, nullptr, 0);
}

void vkCmdDispatchBase(VkCommandBuffer buffer, uint32_t first_x, uint32_t first_y, uint32_t first_z,
                       uint32_t x, uint32_t y, uint32_t z) {
    dispatch(buffer, {first_x, first_y, first_z}, {x, y, z}, nullptr, 0);
}

void vkCmdDispatchIndirect(VkCommandBuffer buffer, VkBuffer groups, VkDeviceSize offset) {
    dispatch(buffer, {}, {}, of<Buffer>(groups), offset);
}

void vkCmdPipelineBarrier(VkCommandBuffer, VkPipelineStageFlags, VkPipelineStageFlags,
                          VkDependencyFlags, uint32_t, const VkMemoryBarrier*, uint32_t,
                          const VkBufferMemoryBarrier*, uint32_t, const VkImageMemoryBarrier*) {}

void vkCmdPipelineBarrier2(VkCommandBuffer, const VkDependencyInfo*) {}

void vkCmdCopyBuffer(VkCommandBuffer buffer, VkBuffer from, VkBuffer to, uint32_t count,
                     const VkBufferCopy* pieces) {
    record(buffer, [&] {
        return CopyBuffer{of<Buffer>(from), of<Buffer>(to), {pieces, pieces + count}};
    });
}

void vkCmdCopyImage(VkCommandBuffer buffer, VkImage from, VkImageLayout, VkImage to, VkImageLayout,
                    uint32_t count, const VkImageCopy* pieces) {
    record(buffer, [&] {
        return CopyImage{of<Image>(from), of<Image>(to), {pieces, pieces + count}};
    });
}

void vkCmdCopyBufferToImage(VkCommandBuffer buffer, VkBuffer from, VkImage to, VkImageLayout,
                            uint32_t count, const VkBufferImageCopy* pieces) {
    record(buffer, [&] {
        return CopyBufferAndImage{of<Buffer>(from), of<Image>(to), true, {pieces, pieces + count}};
    });
}

void vkCmdCopyImageToBuffer(VkCommandBuffer buffer, VkImage from, VkImageLayout, VkBuffer to,
                            uint32_t count, const VkBufferImageCopy* pieces) {
    record(buffer, [&] {
        return CopyBufferAndImage{of<Buffer>(to), of<Image>(from), false, {pieces, pieces + count}};
    });
}

void vkCmdFillBuffer(VkCommandBuffer buffer, VkBuffer to, VkDeviceSize offset, VkDeviceSize size,
                     uint32_t word) {
    const uint64_t bytes = size == VK_WHOLE_SIZE ? of<Buffer>(to)->size - offset : size;
    record(buffer, [&] { return FillBuffer{of<Buffer>(to), offset, bytes / 4 * 4, word}; });
}

void vkCmdUpdateBuffer(VkCommandBuffer buffer, VkBuffer to, VkDeviceSize offset, VkDeviceSize size,
                       const void* data) {
    const auto* bytes = static_cast<const std::byte*>(data);
    record(buffer, [&] { return UpdateBuffer{of<Buffer>(to), offset, {bytes, bytes + size}}; });
}

void vkCmdClearColorImage(VkCommandBuffer buffer, VkImage handle, VkImageLayout,
                          const VkClearColorValue* color, uint32_t count,
                          const VkImageSubresourceRange* ranges) {
    const Image& image = *of<Image>(handle);
    for (uint32_t i = 0; i < count; ++i) {
        const VkImageSubresourceRange& range = ranges[i];
        const uint32_t layers = range.layerCount == VK_REMAINING_ARRAY_LAYERS
                                    ? image.layers - range.baseArrayLayer
                                    : range.layerCount;
        record(buffer, [&] {
            return ClearImage{&image, range.baseArrayLayer, layers, texel_of(image.format, *color)};
        });
    }
}

void vkCmdResetQueryPool(VkCommandBuffer buffer, VkQueryPool pool, uint32_t first, uint32_t count) {
    record(buffer, [&] { return ResetQueries{of<QueryPool>(pool), first, count}; });
}

void vkCmdWriteTimestamp2(VkCommandBuffer buffer, VkPipelineStageFlags2, VkQueryPool pool,
                          uint32_t query) {
    record(buffer, [&] { return WriteTimestamp{of<QueryPool>(pool), query}; });
}

// Names are for layers above this driver.
void vkCmdBeginDebugUtilsLabelEXT(VkCommandBuffer, const VkDebugUtilsLabelEXT*) {}
void vkCmdEndDebugUtilsLabelEXT(VkCommandBuffer) {}
VkResult vkSetDebugUtilsObjectNameEXT(VkDevice, const VkDebugUtilsObjectNameInfoEXT*) {
    return VK_SUCCESS;
}

} // namespace api
} // namespace palpate::native::driver
