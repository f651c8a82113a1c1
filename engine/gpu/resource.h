#pragma once

#include <vulkan/vulkan_core.h>

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <string>

#include "engine/gpu/barrier.h"
#include "engine/gpu/device.h"

namespace palpate {

enum class Memory {
    device,    // read and written by the GPU only
    upload,    // written by the CPU, read by the GPU
    read_back, // written by the GPU, read by the CPU
};

// The kind in ResourceInfo of staging memory, which only carries bytes to or from the device. It is
// recycled, and no limit counts it (GpuDevice::resource_bytes()).
inline constexpr const char* kStagingKind = "staging";

// A range of memory the GPU sees. Dropping it while the GPU still reads it is safe.
class Buffer {
 public:
    // bytes > 0.
    Buffer(GpuDevice& device, std::string name, uint64_t bytes, Memory memory,
           const char* kind = "buffer");
    ~Buffer();
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&&) = delete;

    VkBuffer handle() const { return handle_; }
    uint64_t bytes() const { return bytes_; }
    // Memory::upload and Memory::read_back: the mapped bytes, for the buffer's whole life.
    std::span<std::byte> mapped() const { return {static_cast<std::byte*>(mapped_), bytes_}; }
    UseTracker& tracker() { return tracker_; }

 private:
    GpuDevice* device_;
    VkBuffer handle_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    uint64_t bytes_ = 0;
    void* mapped_ = nullptr;
    UseTracker tracker_;
    GpuDevice::ResourceEntry entry_;
};

// Some bytes of a buffer.
struct BufferSlice {
    BufferSlice(Buffer& whole) : buffer(&whole), bytes(whole.bytes()) {} // NOLINT: all of it
    BufferSlice(Buffer& in, uint64_t first, uint64_t count)
        : buffer(&in), offset(first), bytes(count) {}

    std::span<std::byte> mapped() const { return buffer->mapped().subspan(offset, bytes); }

    Buffer* buffer;
    uint64_t offset = 0, bytes;
};

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

struct ImageShape {
    VkImageType type = VK_IMAGE_TYPE_2D;
    VkFormat format = VK_FORMAT_R32_SFLOAT;
    glm::uvec3 size{1};      // texels; z counts for 3D images only
    uint32_t layers = 1;     // of a 1D or 2D image; a view always sees them as an array
    bool storage = false;    // written by shaders
    bool attachment = false; // drawn to by graphics pipelines
};

// An image with one view of all of it and one mip level.
class GpuImage {
 public:
    GpuImage(GpuDevice& device, std::string name, const ImageShape& shape);
    // One that somebody else made and destroys, as a window's. Nothing is known of what it holds.
    GpuImage(GpuDevice& device, const ImageShape& shape, VkImage existing);
    ~GpuImage();
    GpuImage(GpuImage&& other) noexcept;
    GpuImage& operator=(GpuImage&&) = delete;

    VkImage handle() const { return handle_; }
    VkImageView view() const { return view_; }
    const ImageShape& shape() const { return shape_; }
    uint64_t bytes() const { return bytes_; }
    UseTracker& tracker() { return tracker_; }

 private:
    void make_view();

    GpuDevice* device_;
    ImageShape shape_;
    bool owned_ = true;
    VkImage handle_ = VK_NULL_HANDLE;
    VkImageView view_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    uint64_t bytes_ = 0;
    UseTracker tracker_;
    GpuDevice::ResourceEntry entry_;
};

// Bytes of one texel of an uncompressed colour format of at most 32 bits a channel.
uint32_t bytes_per_texel(VkFormat format);

// How a sampler reads between texels, and beyond the border.
enum class SampleFilter { nearest, linear };
enum class Edge { clamp, border_zero };

class Sampler {
 public:
    Sampler(GpuDevice& device, SampleFilter filter, Edge edge);
    ~Sampler();
    Sampler(const Sampler&) = delete;
    Sampler& operator=(const Sampler&) = delete;
    VkSampler handle() const { return handle_; }

 private:
    GpuDevice* device_;
    VkSampler handle_ = VK_NULL_HANDLE;
};

} // namespace palpate
