#include "engine/gpu/resource.h"

#include <volk.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "engine/base/assert.h"
#include "engine/gpu/error.h"

namespace palpate {

uint32_t bytes_per_texel(VkFormat format) {
    // Formats of one size follow each other in the specification's list; here is the last of each.
    struct Last {
        VkFormat format;
        uint32_t bytes;
    };
    constexpr Last kLasts[] = {
        {VK_FORMAT_R4G4_UNORM_PACK8, 1},  {VK_FORMAT_A1R5G5B5_UNORM_PACK16, 2},
        {VK_FORMAT_R8_SRGB, 1},           {VK_FORMAT_R8G8_SRGB, 2},
        {VK_FORMAT_B8G8R8_SRGB, 3},       {VK_FORMAT_A2B10G10R10_SINT_PACK32, 4},
        {VK_FORMAT_R16_SFLOAT, 2},        {VK_FORMAT_R16G16_SFLOAT, 4},
        {VK_FORMAT_R16G16B16_SFLOAT, 6},  {VK_FORMAT_R16G16B16A16_SFLOAT, 8},
        {VK_FORMAT_R32_SFLOAT, 4},        {VK_FORMAT_R32G32_SFLOAT, 8},
        {VK_FORMAT_R32G32B32_SFLOAT, 12}, {VK_FORMAT_R32G32B32A32_SFLOAT, 16}};
    PALPATE_ASSERT_CMP(static_cast<int>(format), >, static_cast<int>(VK_FORMAT_UNDEFINED));
    PALPATE_ASSERT_CMP(static_cast<int>(format), <=,
                       static_cast<int>(VK_FORMAT_R32G32B32A32_SFLOAT));
    return std::find_if(std::begin(kLasts), std::end(kLasts),
                        [&](const Last& last) { return format <= last.format; })
        ->bytes;
}

Buffer::Buffer(GpuDevice& device, std::string name, uint64_t bytes, Memory memory, const char* kind)
    : device_(&device), bytes_(bytes) {
    PALPATE_ASSERT(bytes > 0);
    const VkBufferCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = bytes,
        .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                 VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT |
                 VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT |
                 VK_BUFFER_USAGE_INDEX_BUFFER_BIT};
    check(vkCreateBuffer(device.handle(), &create, nullptr, &handle_), "creating buffer " + name);
    ++device.created().objects;
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device.handle(), handle_, &needs);
    try {
        memory_ =
            device.allocate(needs, memory != Memory::device, memory == Memory::read_back, name);
    } catch (...) {
        vkDestroyBuffer(device.handle(), handle_, nullptr);
        throw;
    }
    check(vkBindBufferMemory(device.handle(), handle_, memory_, 0), "binding buffer " + name);
    if (memory != Memory::device)
        check(vkMapMemory(device.handle(), memory_, 0, VK_WHOLE_SIZE, 0, &mapped_),
              "mapping buffer " + name);
    device.name_object(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<uint64_t>(handle_), name);
    entry_ = device.enter({std::move(name), kind, needs.size});
}

Buffer::Buffer(Buffer&& other) noexcept
    : device_(other.device_),
      handle_(std::exchange(other.handle_, VK_NULL_HANDLE)),
      memory_(other.memory_),
      bytes_(other.bytes_),
      mapped_(other.mapped_),
      tracker_(other.tracker_),
      entry_(other.entry_) {}

Buffer::~Buffer() {
    if (!handle_)
        return;
    const uint64_t counted = entry_->kind == kStagingKind ? 0 : entry_->bytes;
    device_->leave(entry_);
    device_->retire(
        [device = device_->handle(), buffer = handle_, memory = memory_] {
            vkDestroyBuffer(device, buffer, nullptr);
            vkFreeMemory(device, memory, nullptr);
        },
        counted);
}

GpuImage::GpuImage(GpuDevice& device, std::string name, const ImageShape& shape)
    : device_(&device), shape_(shape) {
    const bool is_3d = shape.type == VK_IMAGE_TYPE_3D;
    const VkImageCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
        .imageType = shape.type,
        .format = shape.format,
        .extent = {shape.size.x, shape.size.y, is_3d ? shape.size.z : 1},
        .mipLevels = 1,
        .arrayLayers = is_3d ? 1 : shape.layers,
        .samples = VK_SAMPLE_COUNT_1_BIT,
        .tiling = VK_IMAGE_TILING_OPTIMAL,
        .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                 VK_IMAGE_USAGE_TRANSFER_DST_BIT |
                 (shape.storage ? VkImageUsageFlags{VK_IMAGE_USAGE_STORAGE_BIT} : 0u) |
                 (shape.attachment ? VkImageUsageFlags{VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT} : 0u)};
    check(vkCreateImage(device.handle(), &create, nullptr, &handle_), "creating image " + name);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device.handle(), handle_, &needs);
    bytes_ = needs.size;
    try {
        memory_ = device.allocate(needs, false, false, name);
    } catch (...) {
        vkDestroyImage(device.handle(), handle_, nullptr);
        throw;
    }
    check(vkBindImageMemory(device.handle(), handle_, memory_, 0), "binding image " + name);
    make_view();
    ++device.created().objects;
    device.name_object(VK_OBJECT_TYPE_IMAGE, reinterpret_cast<uint64_t>(handle_), name);
    entry_ = device.enter({std::move(name), "image", needs.size});
}

GpuImage::GpuImage(GpuDevice& device, const ImageShape& shape, VkImage existing)
    : device_(&device), shape_(shape), owned_(false), handle_(existing) {
    make_view();
    tracker_.forget();
}

void GpuImage::make_view() {
    const VkImageViewCreateInfo view{
        .sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
        .image = handle_,
        .viewType = shape_.type == VK_IMAGE_TYPE_3D   ? VK_IMAGE_VIEW_TYPE_3D
                    : shape_.type == VK_IMAGE_TYPE_1D ? VK_IMAGE_VIEW_TYPE_1D_ARRAY
                                                      : VK_IMAGE_VIEW_TYPE_2D_ARRAY,
        .format = shape_.format,
        .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS}};
    check(vkCreateImageView(device_->handle(), &view, nullptr, &view_), "viewing an image");
    ++device_->created().objects;
}

GpuImage::GpuImage(GpuImage&& other) noexcept
    : device_(other.device_),
      shape_(other.shape_),
      owned_(other.owned_),
      handle_(std::exchange(other.handle_, VK_NULL_HANDLE)),
      view_(other.view_),
      memory_(other.memory_),
      bytes_(other.bytes_),
      tracker_(other.tracker_),
      entry_(other.entry_) {}

GpuImage::~GpuImage() {
    if (!handle_)
        return;
    if (!owned_) {
        device_->retire([device = device_->handle(), view = view_] {
            vkDestroyImageView(device, view, nullptr);
        });
        return;
    }
    device_->leave(entry_);
    device_->retire(
        [device = device_->handle(), image = handle_, view = view_, memory = memory_] {
            vkDestroyImageView(device, view, nullptr);
            vkDestroyImage(device, image, nullptr);
            vkFreeMemory(device, memory, nullptr);
        },
        bytes_);
}

Sampler::Sampler(GpuDevice& device, SampleFilter filter, Edge edge) : device_(&device) {
    const VkFilter f = filter == SampleFilter::linear ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
    const VkSamplerAddressMode mode = edge == Edge::clamp ? VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE
                                                          : VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER;
    const VkSamplerCreateInfo create{.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                     .magFilter = f,
                                     .minFilter = f,
                                     .mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST,
                                     .addressModeU = mode,
                                     .addressModeV = mode,
                                     .addressModeW = mode,
                                     .borderColor = VK_BORDER_COLOR_INT_TRANSPARENT_BLACK};
    check(vkCreateSampler(device.handle(), &create, nullptr, &handle_), "creating a sampler");
    ++device.created().objects;
}

Sampler::~Sampler() {
    device_->retire([device = device_->handle(), sampler = handle_] {
        vkDestroySampler(device, sampler, nullptr);
    });
}

} // namespace palpate
