// Memory, and the buffers, images and samplers that lie in it.

#include <atomic>
#include <cstdlib>
#include <fstream>

#include "engine/base/memory.h"
#include "engine/native/driver/api.h"
#include "engine/native/driver/objects.h"

namespace palpate::native::driver {

namespace {

constexpr uint64_t kAlignment = 64;

std::atomic<uint64_t> allocated = 0;

uint64_t round_up(uint64_t value) {
    return (value + kAlignment - 1) / kAlignment * kAlignment;
}

VkMemoryRequirements requirements(uint64_t bytes) {
    return {.size = round_up(bytes), .alignment = kAlignment, .memoryTypeBits = 1};
}

// An image needs its texels, and bytes around them that kernels may read.
uint64_t needed_bytes(const Image& image) {
    return kGuardBytes + round_up(image.bytes()) + kGuardBytes;
}

// Why an image cannot be made; empty if it can.
std::string refusal_of(const VkImageCreateInfo& info) {
    VkImageFormatProperties most;
    if (api::vkGetPhysicalDeviceImageFormatProperties(nullptr, info.format, info.imageType,
                                                      info.tiling, info.usage, info.flags,
                                                      &most) != VK_SUCCESS)
        return fmt::format("the format {} is not there with usage {:#x}, tiling {} and flags {:#x}",
                           static_cast<int>(info.format), info.usage, static_cast<int>(info.tiling),
                           info.flags);
    if (info.mipLevels != 1 || info.samples != VK_SAMPLE_COUNT_1_BIT)
        return fmt::format("expected one mip level and one sample a texel, found {} and {}",
                           info.mipLevels, static_cast<int>(info.samples));
    const VkExtent3D& size = info.extent;
    if (size.width > most.maxExtent.width || size.height > most.maxExtent.height ||
        size.depth > most.maxExtent.depth || info.arrayLayers > most.maxArrayLayers)
        return fmt::format("{} x {} x {} texels in {} layers are more than {} x {} x {} in {}",
                           size.width, size.height, size.depth, info.arrayLayers,
                           most.maxExtent.width, most.maxExtent.height, most.maxExtent.depth,
                           most.maxArrayLayers);
    return {};
}

} // namespace

uint64_t allocated_bytes() {
    return allocated;
}

uint64_t available_memory_bytes() {
    std::ifstream file("/proc/meminfo");
    std::string word;
    uint64_t kib = 0;
    while (file >> word)
        if (word == "MemAvailable:" && file >> kib)
            return kib << 10;
    return 0;
}

namespace api {

VkResult vkAllocateMemory(VkDevice, const VkMemoryAllocateInfo* info, const VkAllocationCallbacks*,
                          VkDeviceMemory* out) {
    const uint64_t size = round_up(info->allocationSize) + kGuardBytes;
    if (allocated.fetch_add(size) + size > physical_memory_bytes()) {
        allocated -= size;
        return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    }
    std::unique_ptr<std::byte, void (*)(void*)> bytes(
        static_cast<std::byte*>(std::aligned_alloc(kAlignment, size)), std::free);
    const VkResult made = !bytes ? VK_ERROR_OUT_OF_DEVICE_MEMORY : create(out, [&] {
        auto memory = std::make_unique<Memory>();
        memory->bytes = std::move(bytes);
        memory->size = size;
        return memory;
    });
    if (made != VK_SUCCESS)
        allocated -= size;
    return made;
}

void vkFreeMemory(VkDevice, VkDeviceMemory handle, const VkAllocationCallbacks*) {
    if (!handle)
        return;
    allocated -= of<Memory>(handle)->size;
    delete of<Memory>(handle);
}

VkResult vkMapMemory(VkDevice, VkDeviceMemory memory, VkDeviceSize offset, VkDeviceSize,
                     VkMemoryMapFlags, void** out) {
    *out = of<Memory>(memory)->bytes.get() + offset;
    return VK_SUCCESS;
}

void vkUnmapMemory(VkDevice, VkDeviceMemory) {}

VkResult vkCreateBuffer(VkDevice, const VkBufferCreateInfo* info, const VkAllocationCallbacks*,
                        VkBuffer* out) {
    if (info->flags)
        return refuse("vkCreateBuffer: flags {:#x} are not there", info->flags);
    return create(out, [&] {
        auto buffer = std::make_unique<Buffer>();
        buffer->size = info->size;
        return buffer;
    });
}

void vkDestroyBuffer(VkDevice, VkBuffer buffer, const VkAllocationCallbacks*) {
    delete of<Buffer>(buffer);
}

void vkGetBufferMemoryRequirements(VkDevice, VkBuffer buffer, VkMemoryRequirements* out) {
    *out = requirements(of<Buffer>(buffer)->size);
}

void vkGetBufferMemoryRequirements2(VkDevice, const VkBufferMemoryRequirementsInfo2* info,
                                    VkMemoryRequirements2* out) {
    out->memoryRequirements = requirements(of<Buffer>(info->buffer)->size);
}

VkResult vkBindBufferMemory(VkDevice, VkBuffer buffer, VkDeviceMemory memory, VkDeviceSize offset) {
    of<Buffer>(buffer)->data = of<Memory>(memory)->bytes.get() + offset;
    return VK_SUCCESS;
}

VkResult vkBindBufferMemory2(VkDevice device, uint32_t count, const VkBindBufferMemoryInfo* infos) {
    for (uint32_t i = 0; i < count; ++i)
        vkBindBufferMemory(device, infos[i].buffer, infos[i].memory, infos[i].memoryOffset);
    return VK_SUCCESS;
}

VkResult vkCreateImage(VkDevice, const VkImageCreateInfo* info, const VkAllocationCallbacks*,
                       VkImage* out) {
    if (const std::string why = refusal_of(*info); !why.empty())
        return refuse("vkCreateImage: {}", why);
    return create(out, [&] {
        auto image = std::make_unique<Image>();
        image->type = info->imageType;
        image->format = info->format;
        image->size = info->extent;
        image->layers = info->arrayLayers;
        return image;
    });
}

void vkDestroyImage(VkDevice, VkImage image, const VkAllocationCallbacks*) {
    delete of<Image>(image);
}

void vkGetImageMemoryRequirements(VkDevice, VkImage image, VkMemoryRequirements* out) {
    *out = requirements(needed_bytes(*of<Image>(image)));
}

void vkGetImageMemoryRequirements2(VkDevice, const VkImageMemoryRequirementsInfo2* info,
                                   VkMemoryRequirements2* out) {
    out->memoryRequirements = requirements(needed_bytes(*of<Image>(info->image)));
}

VkResult vkBindImageMemory(VkDevice, VkImage image, VkDeviceMemory memory, VkDeviceSize offset) {
    of<Image>(image)->texels = of<Memory>(memory)->bytes.get() + offset + kGuardBytes;
    return VK_SUCCESS;
}

VkResult vkBindImageMemory2(VkDevice device, uint32_t count, const VkBindImageMemoryInfo* infos) {
    for (uint32_t i = 0; i < count; ++i)
        vkBindImageMemory(device, infos[i].image, infos[i].memory, infos[i].memoryOffset);
    return VK_SUCCESS;
}

VkResult vkCreateImageView(VkDevice, const VkImageViewCreateInfo* info,
                           const VkAllocationCallbacks*, VkImageView* out) {
    const Image& image = *of<Image>(info->image);
    if (info->format != image.format)
        return refuse("vkCreateImageView: the view's format {} is not the image's {}",
                      static_cast<int>(info->format), static_cast<int>(image.format));
    const VkImageSubresourceRange& range = info->subresourceRange;
    const uint32_t layers = range.layerCount == VK_REMAINING_ARRAY_LAYERS
                                ? image.layers - range.baseArrayLayer
                                : range.layerCount;
    native::Image seen{.texels = image.texels + range.baseArrayLayer * image.layer_bytes(),
                       .format = image.format,
                       .width = image.size.width,
                       .height = image.size.height,
                       .row_bytes = static_cast<int64_t>(image.row_bytes()),
                       .slice_bytes = static_cast<int64_t>(image.slice_bytes())};
    switch (info->viewType) {
        case VK_IMAGE_VIEW_TYPE_1D:
        case VK_IMAGE_VIEW_TYPE_2D:
            break;
        case VK_IMAGE_VIEW_TYPE_1D_ARRAY:
        case VK_IMAGE_VIEW_TYPE_2D_ARRAY:
            seen.depth = layers;
            seen.is_array = true;
            break;
        case VK_IMAGE_VIEW_TYPE_3D:
            seen.depth = image.size.depth;
            break;
        default:
            return refuse("vkCreateImageView: views of type {} are not there",
                          static_cast<int>(info->viewType));
    }
    return create(out, [&] { return std::make_unique<ImageView>(ImageView{seen}); });
}

void vkDestroyImageView(VkDevice, VkImageView view, const VkAllocationCallbacks*) {
    delete of<ImageView>(view);
}

VkResult vkCreateSampler(VkDevice, const VkSamplerCreateInfo* info, const VkAllocationCallbacks*,
                         VkSampler* out) {
    const VkSamplerAddressMode mode = info->addressModeU;
    const bool clamps = mode == VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    const bool is_zero_beyond = mode == VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER &&
                                (info->borderColor == VK_BORDER_COLOR_INT_TRANSPARENT_BLACK ||
                                 info->borderColor == VK_BORDER_COLOR_FLOAT_TRANSPARENT_BLACK);
    if (info->magFilter != info->minFilter || mode != info->addressModeV ||
        mode != info->addressModeW || !(clamps || is_zero_beyond) || info->anisotropyEnable ||
        info->compareEnable || info->mipLodBias != 0.0f)
        return refuse(
            "vkCreateSampler: expected one filter, and for all axes the edge or zeros beyond it");
    return create(out, [&] {
        return std::make_unique<Sampler>(
            Sampler{.is_linear = info->magFilter == VK_FILTER_LINEAR,
                    .is_normalised = info->unnormalizedCoordinates == VK_FALSE,
                    .is_clamped_to_border = is_zero_beyond});
    });
}

void vkDestroySampler(VkDevice, VkSampler sampler, const VkAllocationCallbacks*) {
    delete of<Sampler>(sampler);
}

} // namespace api
} // namespace palpate::native::driver
