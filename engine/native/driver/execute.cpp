// Does what was recorded.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <ctime>

#include "engine/native/driver/objects.h"

namespace palpate::native::driver {

namespace {

// Tasks of a dispatch that each thread takes on average: as many as level out groups of unlike
// work, unless their groups are fewer than a task is worth.
constexpr uint64_t kTasksPerThread = 32;
constexpr uint64_t kMostGroupsPerTask = 64;

// A box of texels in memory.
struct Texels {
    std::byte* first;
    uint64_t row_bytes, slice_bytes, layer_bytes; // from one to the next
};

Texels texels_of(const Image& image, const VkOffset3D& offset, uint32_t layer) {
    const auto at = [](int32_t value) { return static_cast<uint64_t>(value); };
    return {image.texels + layer * image.layer_bytes() + at(offset.z) * image.slice_bytes() +
                at(offset.y) * image.row_bytes() + at(offset.x) * texel_bytes(image.format),
            image.row_bytes(), image.slice_bytes(), image.layer_bytes()};
}

void copy(const Texels& from, const Texels& to, const VkExtent3D& size, uint32_t layers,
          uint64_t bytes_per_texel) {
    const uint64_t row = size.width * bytes_per_texel, slice = row * size.height;
    const bool has_whole_slices = row == from.row_bytes && row == to.row_bytes;
    for (uint64_t layer = 0; layer < layers; ++layer)
        for (uint64_t z = 0; z < size.depth; ++z) {
            const std::byte* a = from.first + layer * from.layer_bytes + z * from.slice_bytes;
            std::byte* b = to.first + layer * to.layer_bytes + z * to.slice_bytes;
            if (has_whole_slices) {
                std::memcpy(b, a, slice);
                continue;
            }
            for (uint64_t y = 0; y < size.height; ++y)
                std::memcpy(b + y * to.row_bytes, a + y * from.row_bytes, row);
        }
}

void execute(Device&, const CopyBuffer& command) {
    for (const VkBufferCopy& piece : command.pieces)
        std::memcpy(command.to->data + piece.dstOffset, command.from->data + piece.srcOffset,
                    piece.size);
}

// Layers of a 2D image may be copied to slices of a 3D one, and back.
void execute(Device&, const CopyImage& command) {
    for (const VkImageCopy& piece : command.pieces) {
        Texels from =
            texels_of(*command.from, piece.srcOffset, piece.srcSubresource.baseArrayLayer);
        Texels to = texels_of(*command.to, piece.dstOffset, piece.dstSubresource.baseArrayLayer);
        const bool from_3d = command.from->type == VK_IMAGE_TYPE_3D;
        const bool to_3d = command.to->type == VK_IMAGE_TYPE_3D;
        VkExtent3D size = piece.extent;
        uint32_t layers = piece.srcSubresource.layerCount;
        if (from_3d != to_3d) {
            layers = from_3d ? piece.extent.depth : layers;
            size.depth = 1;
            (from_3d ? from : to).layer_bytes = (from_3d ? from : to).slice_bytes;
        }
        copy(from, to, size, layers, texel_bytes(command.from->format));
    }
}

void execute(Device&, const CopyBufferAndImage& command) {
    for (const VkBufferImageCopy& piece : command.pieces) {
        const VkExtent3D& size = piece.imageExtent;
        const uint64_t texel = texel_bytes(command.image->format);
        const uint64_t row = (piece.bufferRowLength ? piece.bufferRowLength : size.width) * texel;
        const uint64_t slice =
            (piece.bufferImageHeight ? piece.bufferImageHeight : size.height) * row;
        const Texels in_buffer{command.buffer->data + piece.bufferOffset, row, slice,
                               slice * size.depth};
        const Texels in_image =
            texels_of(*command.image, piece.imageOffset, piece.imageSubresource.baseArrayLayer);
        copy(command.to_image ? in_buffer : in_image, command.to_image ? in_image : in_buffer, size,
             piece.imageSubresource.layerCount, texel);
    }
}

void execute(Device&, const FillBuffer& command) {
    std::byte* first = command.buffer->data + command.offset;
    if (command.word == 0) {
        std::memset(first, 0, command.bytes);
        return;
    }
    for (uint64_t at = 0; at < command.bytes; at += sizeof command.word)
        std::memcpy(first + at, &command.word, sizeof command.word);
}

void execute(Device&, const UpdateBuffer& command) {
    std::memcpy(command.buffer->data + command.offset, command.bytes.data(), command.bytes.size());
}

void execute(Device&, const ClearImage& command) {
    const Image& image = *command.image;
    const uint64_t texel = texel_bytes(image.format);
    const uint64_t bytes = command.layers * image.layer_bytes();
    std::byte* first = image.texels + command.first_layer * image.layer_bytes();
    if (std::all_of(command.texel.begin(), command.texel.begin() + static_cast<ptrdiff_t>(texel),
                    [&](std::byte byte) { return byte == command.texel[0]; })) {
        std::memset(first, static_cast<int>(command.texel[0]), bytes);
        return;
    }
    for (uint64_t at = 0; at < bytes; at += texel)
        std::memcpy(first + at, command.texel.data(), texel);
}

void execute(Device&, const Dispatch& command) {
    const Kernel& kernel = *command.pipeline->kernel;
    Launch launch{.resources = command.resources,
                  .constants = command.pipeline->constants,
                  .push_constants = command.push_constants,
                  .first_group = command.first_group,
                  .groups = command.groups};
    if (command.indirect)
        std::memcpy(launch.groups.data(), command.indirect->data + command.offset,
                    sizeof launch.groups);
    const uint64_t all = uint64_t{launch.groups[0]} * launch.groups[1] * launch.groups[2];
    if (all <= 1) {
        if (all == 1)
            kernel.run(launch, 0, 1);
        return;
    }
    const auto threads = static_cast<uint64_t>(tbb::this_task_arena::max_concurrency());
    const uint64_t grain =
        std::clamp(all / (threads * kTasksPerThread), uint64_t{1}, kMostGroupsPerTask);
    tbb::parallel_for(
        tbb::blocked_range<uint64_t>(0, all, grain),
        [&](const tbb::blocked_range<uint64_t>& part) {
            kernel.run(launch, part.begin(), part.size());
        },
        tbb::simple_partitioner());
}

void execute(Device&, const DrawTriangles& command) {
    driver::execute(command);
}

void execute(Device&, const ClearRectangles& command) {
    driver::execute(command);
}

void execute(Device& device, const ResetQueries& command) {
    const std::scoped_lock lock(device.mutex);
    std::fill_n(command.pool->queries.begin() + command.first, command.count, QueryPool::Query{});
}

void execute(Device& device, const WriteTimestamp& command) {
    {
        const std::scoped_lock lock(device.mutex);
        command.pool->queries[command.query] = {clock_ns(), true};
    }
    device.changed.notify_all();
}

} // namespace

uint64_t clock_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<uint64_t>(now.tv_sec) * 1'000'000'000u + static_cast<uint64_t>(now.tv_nsec);
}

void execute(Device& device, const CommandBuffer& buffer) {
    for (const Command& command : buffer.commands)
        std::visit([&](const auto& one) { execute(device, one); }, command);
}

} // namespace palpate::native::driver
