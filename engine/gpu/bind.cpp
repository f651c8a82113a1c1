// Checks the resources that a dispatch reads and writes against those that its shader declares.

#include <fmt/format.h>
#include <volk.h>

#include <algorithm>
#include <string_view>

#include "engine/base/assert.h"
#include "engine/gpu/command_slot.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/offer.h"
#include "engine/gpu/recorded.h"

namespace palpate {

namespace {

VkDescriptorType type_of(const Bound& bound) {
    if (std::holds_alternative<BufferSlice>(bound.resource))
        return bound.use == Use::uniform ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER
                                         : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    return bound.sampler ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER
                         : VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
}

std::string_view name_of(VkDescriptorType type) {
    switch (type) {
        case VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER:
            return "a uniform buffer";
        case VK_DESCRIPTOR_TYPE_STORAGE_BUFFER:
            return "a storage buffer";
        case VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER:
            return "an image with its sampler";
        default:
            return "a storage image";
    }
}

// Why what is bound to a slot does not fit it; empty where it does. Null: nothing is.
std::string misfit(const BindingSlot& slot, const Bound* bound) {
    if (!bound)
        return fmt::format("expected {}, found nothing", name_of(slot.type));
    if (type_of(*bound) != slot.type)
        return fmt::format("expected {}, found {}", name_of(slot.type), name_of(type_of(*bound)));
    const auto* slice = std::get_if<BufferSlice>(&bound->resource);
    if (slice && slice->bytes < slot.least_bytes)
        return fmt::format("expected {} bytes or more, found {}", slot.least_bytes, slice->bytes);
    return {};
}

void check_fits(const ComputePipeline& pipeline, std::span<const Bound> bound) {
    const auto fail = [&](uint32_t binding, const char* name, const std::string& why) {
        assertion_failed(
            "what is bound fits the shader",
            fmt::format("{}: binding {} ({}): {}", pipeline.name(), binding, name, why), __FILE__,
            __LINE__);
    };
    for (const BindingSlot& slot : pipeline.slots()) {
        const auto found = std::find_if(bound.begin(), bound.end(),
                                        [&](const Bound& b) { return b.binding == slot.binding; });
        const std::string why = misfit(slot, found == bound.end() ? nullptr : &*found);
        if (!why.empty())
            fail(slot.binding, slot.name, why);
    }
    if (bound.size() == pipeline.slots().size())
        return;
    for (const Bound& b : bound)
        if (std::none_of(pipeline.slots().begin(), pipeline.slots().end(),
                         [&](const BindingSlot& slot) { return slot.binding == b.binding; }))
            fail(b.binding, "none", fmt::format("expected nothing, found {}", name_of(type_of(b))));
    PALPATE_ASSERT_CMP(bound.size(), ==, pipeline.slots().size()); // one is bound twice
}

} // namespace

std::vector<Bound> Offer::taken_by(const ComputePipeline& pipeline) const {
    std::vector<Bound> taken;
    for (const Bound& bound : offered_)
        if (std::any_of(pipeline.slots().begin(), pipeline.slots().end(),
                        [&](const BindingSlot& slot) { return slot.binding == bound.binding; }))
            taken.push_back(bound);
    return taken;
}

void Commands::bind(const ComputePipeline& pipeline, std::span<const Bound> bound) {
    check_fits(pipeline, bound);
    const VkDescriptorSet set = slot().take_set(pipeline.set_layout());
    std::vector<VkDescriptorBufferInfo> buffers(bound.size());
    std::vector<VkDescriptorImageInfo> images(bound.size());
    std::vector<VkWriteDescriptorSet> writes;
    for (size_t i = 0; i < bound.size(); ++i) {
        const Bound& b = bound[i];
        VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                   .dstSet = set,
                                   .dstBinding = b.binding,
                                   .descriptorCount = 1,
                                   .descriptorType = type_of(b)};
        if (const auto* slice = std::get_if<BufferSlice>(&b.resource)) {
            use(*slice->buffer, b.use);
            buffers[i] = {slice->buffer->handle(), slice->offset, slice->bytes};
            write.pBufferInfo = &buffers[i];
        } else {
            GpuImage& image = *std::get<GpuImage*>(b.resource);
            use(image, b.use);
            images[i] = {b.sampler ? b.sampler->handle() : VK_NULL_HANDLE, image.view(),
                         access_of(b.use).layout};
            write.pImageInfo = &images[i];
        }
        writes.push_back(write);
    }
    vkUpdateDescriptorSets(device_->handle(), static_cast<uint32_t>(writes.size()), writes.data(),
                           0, nullptr);
    if (in_pass_ && pipeline.take_first_use()) {
        std::string& names = recorded_->open().passes.back().first_uses;
        names += (names.empty() ? "" : ", ") + pipeline.name();
    }
    vkCmdBindPipeline(handle(), VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
    vkCmdBindDescriptorSets(handle(), VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), 0, 1, &set,
                            0, nullptr);
}

} // namespace palpate
