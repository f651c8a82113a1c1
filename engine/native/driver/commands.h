#pragma once

#include <vulkan/vulkan_core.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "engine/native/kernel.h"

// Commands as they are recorded. Barriers leave none: each command ends before the next begins.
namespace palpate::native::driver {

struct Buffer;
struct Image;
struct Pipeline;
struct QueryPool;
struct Device;
struct CommandBuffer;

struct CopyBuffer {
    const Buffer *from, *to;
    std::vector<VkBufferCopy> pieces;
};

struct CopyImage {
    const Image *from, *to;
    std::vector<VkImageCopy> pieces;
};

struct CopyBufferAndImage {
    const Buffer* buffer;
    const Image* image;
    bool to_image;
    std::vector<VkBufferImageCopy> pieces;
};

struct FillBuffer {
    const Buffer* buffer;
    uint64_t offset, bytes; // multiples of 4
    uint32_t word;
};

struct UpdateBuffer {
    const Buffer* buffer;
    uint64_t offset;
    std::vector<std::byte> bytes;
};

struct ClearImage {
    const Image* image;
    uint32_t first_layer, layers;
    std::array<std::byte, 16> texel; // as many bytes of it as one has
};

struct Dispatch {
    const Pipeline* pipeline;
    std::vector<Resource> resources; // of the kernel's bindings
    std::array<std::byte, 128> push_constants;
    std::array<uint32_t, 3> first_group, groups;
    const Buffer* indirect; // three words from `offset` on instead of `groups`; or null
    uint64_t offset;
};

// The interface draws these (triangles.h).
struct DrawTriangles {
    native::Image target;
    Resource texture;
    std::array<float, 2> size_px; // that positions are given in
    VkRect2D scissor;
    const Buffer *vertices, *indices;
    uint64_t vertex_offset, index_offset; // bytes
    bool has_long_indices;                // of 32 bits, not 16
    uint32_t first_index, count;
    int32_t first_vertex;
};

struct ClearRectangles {
    native::Image target;
    std::array<std::byte, 16> texel;
    std::vector<VkRect2D> rectangles;
};

struct ResetQueries {
    QueryPool* pool;
    uint32_t first, count;
};

struct WriteTimestamp {
    QueryPool* pool;
    uint32_t query;
};

using Command =
    std::variant<CopyBuffer, CopyImage, CopyBufferAndImage, FillBuffer, UpdateBuffer, ClearImage,
                 Dispatch, DrawTriangles, ClearRectangles, ResetQueries, WriteTimestamp>;

} // namespace palpate::native::driver
