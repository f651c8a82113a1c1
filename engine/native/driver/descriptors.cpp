// Layouts, pools and sets of descriptors.

#include <algorithm>

#include "engine/native/driver/api.h"
#include "engine/native/driver/objects.h"

namespace palpate::native::driver {

namespace {

bool is_known(VkDescriptorType type) {
    return type == VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER || type == VK_DESCRIPTOR_TYPE_STORAGE_BUFFER ||
           type == VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER ||
           type == VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
}

// How many descriptors of a type a pool has left; null where it has none at all.
VkDescriptorPoolSize* taken_of(DescriptorPool& pool, VkDescriptorType type) {
    const auto found = std::find_if(pool.taken.begin(), pool.taken.end(),
                                    [&](const auto& size) { return size.type == type; });
    return found == pool.taken.end() ? nullptr : &*found;
}

// True where the pool holds these in addition; then they are taken.
bool take(DescriptorPool& pool, const SetLayout& layout) {
    if (pool.taken_sets == pool.most_sets)
        return false;
    const std::vector<VkDescriptorPoolSize> before = pool.taken;
    for (const VkDescriptorSetLayoutBinding& binding : layout.bindings) {
        VkDescriptorPoolSize* size = taken_of(pool, binding.descriptorType);
        if (!size || ++size->descriptorCount >
                         pool.most[static_cast<size_t>(size - pool.taken.data())].descriptorCount) {
            pool.taken = before;
            return false;
        }
    }
    ++pool.taken_sets;
    return true;
}

void write(DescriptorSet::Slot& slot, const VkWriteDescriptorSet& from) {
    slot.is_written = true;
    slot.resource = {};
    if (from.descriptorType == VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER ||
        from.descriptorType == VK_DESCRIPTOR_TYPE_STORAGE_BUFFER) {
        const VkDescriptorBufferInfo& info = *from.pBufferInfo;
        const Buffer& buffer = *of<Buffer>(info.buffer);
        slot.resource.buffer = {buffer.data + info.offset, info.range == VK_WHOLE_SIZE
                                                               ? buffer.size - info.offset
                                                               : info.range};
        return;
    }
    slot.resource.image = of<ImageView>(from.pImageInfo->imageView)->image;
    if (from.descriptorType == VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER)
        slot.resource.sampler = *of<Sampler>(from.pImageInfo->sampler);
}

} // namespace

void DescriptorPool::give(DescriptorSet& set) {
    for (const DescriptorSet::Slot& slot : set.slots)
        --taken_of(*this, slot.type)->descriptorCount;
    set.is_taken = false;
    --taken_sets;
}

namespace api {

VkResult vkCreateDescriptorSetLayout(VkDevice, const VkDescriptorSetLayoutCreateInfo* info,
                                     const VkAllocationCallbacks*, VkDescriptorSetLayout* out) {
    if (info->flags)
        return refuse("vkCreateDescriptorSetLayout: flags {:#x} are not there", info->flags);
    for (uint32_t i = 0; i < info->bindingCount; ++i) {
        const VkDescriptorSetLayoutBinding& binding = info->pBindings[i];
        if (!is_known(binding.descriptorType) || binding.descriptorCount != 1)
            return refuse(
                "vkCreateDescriptorSetLayout: binding {}: expected a buffer, a storage image or an "
                "image with its sampler, found {} descriptors of type {}",
                binding.binding, binding.descriptorCount, static_cast<int>(binding.descriptorType));
    }
    return create(out, [&] {
        auto layout = std::make_unique<SetLayout>();
        layout->bindings.assign(info->pBindings, info->pBindings + info->bindingCount);
        return layout;
    });
}

void vkDestroyDescriptorSetLayout(VkDevice, VkDescriptorSetLayout layout,
                                  const VkAllocationCallbacks*) {
    delete of<SetLayout>(layout);
}

VkResult vkCreateDescriptorPool(VkDevice, const VkDescriptorPoolCreateInfo* info,
                                const VkAllocationCallbacks*, VkDescriptorPool* out) {
    return create(out, [&] {
        auto pool = std::make_unique<DescriptorPool>();
        pool->most_sets = info->maxSets;
        pool->most.assign(info->pPoolSizes, info->pPoolSizes + info->poolSizeCount);
        pool->taken = pool->most;
        for (VkDescriptorPoolSize& size : pool->taken)
            size.descriptorCount = 0;
        return pool;
    });
}

void vkDestroyDescriptorPool(VkDevice, VkDescriptorPool pool, const VkAllocationCallbacks*) {
    delete of<DescriptorPool>(pool);
}

VkResult vkResetDescriptorPool(VkDevice, VkDescriptorPool handle, VkDescriptorPoolResetFlags) {
    DescriptorPool& pool = *of<DescriptorPool>(handle);
    for (const auto& set : pool.sets)
        set->is_taken = false;
    pool.taken_sets = 0;
    for (VkDescriptorPoolSize& size : pool.taken)
        size.descriptorCount = 0;
    return VK_SUCCESS;
}

VkResult vkAllocateDescriptorSets(VkDevice, const VkDescriptorSetAllocateInfo* info,
                                  VkDescriptorSet* out) {
    DescriptorPool& pool = *of<DescriptorPool>(info->descriptorPool);
    const auto fail = [&](uint32_t made, VkResult why) {
        for (uint32_t i = 0; i < made; ++i)
            pool.give(*of<DescriptorSet>(out[i]));
        std::fill_n(out, info->descriptorSetCount, VkDescriptorSet{});
        return why;
    };
    for (uint32_t i = 0; i < info->descriptorSetCount; ++i) {
        const SetLayout& layout = *of<SetLayout>(info->pSetLayouts[i]);
        if (!take(pool, layout))
            return fail(i, VK_ERROR_OUT_OF_POOL_MEMORY);
        try {
            auto free = std::find_if(pool.sets.begin(), pool.sets.end(),
                                     [](const auto& set) { return !set->is_taken; });
            if (free == pool.sets.end())
                free = pool.sets.insert(pool.sets.end(), std::make_unique<DescriptorSet>());
            DescriptorSet& set = **free;
            set.slots.clear();
            for (const VkDescriptorSetLayoutBinding& binding : layout.bindings)
                set.slots.push_back({.binding = binding.binding, .type = binding.descriptorType});
            set.is_taken = true;
            out[i] = handle_of<VkDescriptorSet>(&set);
        } catch (const std::bad_alloc&) {
            return fail(i, VK_ERROR_OUT_OF_HOST_MEMORY);
        }
    }
    return VK_SUCCESS;
}

VkResult vkFreeDescriptorSets(VkDevice, VkDescriptorPool pool, uint32_t count,
                              const VkDescriptorSet* sets) {
    for (uint32_t i = 0; i < count; ++i)
        if (sets[i])
            of<DescriptorPool>(pool)->give(*of<DescriptorSet>(sets[i]));
    return VK_SUCCESS;
}

void vkUpdateDescriptorSets(VkDevice, uint32_t count, const VkWriteDescriptorSet* writes,
                            uint32_t copies, const VkCopyDescriptorSet*) {
    if (copies > 0)
        complain("vkUpdateDescriptorSets: copies of descriptors are not there");
    for (uint32_t i = 0; i < count; ++i) {
        const VkWriteDescriptorSet& from = writes[i];
        DescriptorSet& set = *of<DescriptorSet>(from.dstSet);
        const auto slot = std::find_if(set.slots.begin(), set.slots.end(),
                                       [&](const auto& s) { return s.binding == from.dstBinding; });
        if (slot == set.slots.end() || slot->type != from.descriptorType ||
            from.descriptorCount != 1 || from.dstArrayElement != 0)
            complain(
                fmt::format("vkUpdateDescriptorSets: binding {} of the set is not one "
                            "descriptor of type {}",
                            from.dstBinding, static_cast<int>(from.descriptorType)));
        else
            write(*slot, from);
    }
}

VkResult vkCreatePipelineLayout(VkDevice, const VkPipelineLayoutCreateInfo* info,
                                const VkAllocationCallbacks*, VkPipelineLayout* out) {
    PipelineLayout layout{.sets = info->setLayoutCount};
    for (uint32_t i = 0; i < info->pushConstantRangeCount; ++i)
        layout.push_constant_bytes =
            std::max(layout.push_constant_bytes,
                     info->pPushConstantRanges[i].offset + info->pPushConstantRanges[i].size);
    if (layout.sets > std::tuple_size_v<decltype(CommandBuffer::sets)> ||
        layout.push_constant_bytes > sizeof(CommandBuffer::push_constants))
        return refuse("vkCreatePipelineLayout: {} sets and {} bytes of push constants are too many",
                      layout.sets, layout.push_constant_bytes);
    return create(out, [&] { return std::make_unique<PipelineLayout>(layout); });
}

void vkDestroyPipelineLayout(VkDevice, VkPipelineLayout layout, const VkAllocationCallbacks*) {
    delete of<PipelineLayout>(layout);
}

} // namespace api
} // namespace palpate::native::driver
