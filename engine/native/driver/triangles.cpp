#include "engine/native/driver/triangles.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "engine/native/driver/api.h"
#include "engine/native/driver/objects.h"
#include "engine/native/driver/texel.h"

namespace palpate::native {

namespace driver {

namespace {

std::atomic<uint64_t> known_vertex_hash = 0, known_fragment_hash = 0;

// Why a pipeline is another than that of triangles.h; empty if it is that one.
std::string refusal_of(const VkGraphicsPipelineCreateInfo& info) {
    bool is_known = info.stageCount == 2;
    for (uint32_t i = 0; i < info.stageCount; ++i) {
        const uint64_t hash = of<ShaderModule>(info.pStages[i].module)->hash;
        is_known &=
            hash == (info.pStages[i].stage == VK_SHADER_STAGE_VERTEX_BIT ? known_vertex_hash
                                                                         : known_fragment_hash);
    }
    return is_known ? "" : "its shaders are not those of the interface";
}

native::Image drawn_to(const VkRenderingAttachmentInfo& attachment) {
    return of<ImageView>(attachment.imageView)->image;
}

bool is_drawn_to(VkFormat format) {
    return format == VK_FORMAT_R8G8B8A8_UNORM || format == VK_FORMAT_B8G8R8A8_UNORM;
}

} // namespace

namespace api {

VkResult vkCreateGraphicsPipelines(VkDevice, VkPipelineCache, uint32_t count,
                                   const VkGraphicsPipelineCreateInfo* infos,
                                   const VkAllocationCallbacks*, VkPipeline* out) {
    std::fill_n(out, count, VkPipeline{});
    for (uint32_t i = 0; i < count; ++i) {
        if (const std::string why = refusal_of(infos[i]); !why.empty())
            return refuse("vkCreateGraphicsPipelines: {}", why);
        if (const VkResult made = create(&out[i], [] { return std::make_unique<Pipeline>(); });
            made != VK_SUCCESS)
            return made;
    }
    return VK_SUCCESS;
}

void vkCmdBeginRendering(VkCommandBuffer handle, const VkRenderingInfo* info) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    if (info->colorAttachmentCount != 1 || info->pDepthAttachment || info->pStencilAttachment ||
        info->layerCount != 1 || !is_drawn_to(drawn_to(info->pColorAttachments[0]).format))
        return buffer.fail(
            "vkCmdBeginRendering: expected one layer of one image of 8 bits a channel");
    const VkRenderingAttachmentInfo& color = info->pColorAttachments[0];
    buffer.drawing.target = drawn_to(color);
    if (color.loadOp == VK_ATTACHMENT_LOAD_OP_CLEAR)
        record(buffer, [&] {
            return ClearRectangles{buffer.drawing.target,
                                   texel_of(buffer.drawing.target.format, color.clearValue.color),
                                   {info->renderArea}};
        });
}

void vkCmdEndRendering(VkCommandBuffer buffer) {
    of<CommandBuffer>(buffer)->drawing.target = {};
}

void vkCmdClearAttachments(VkCommandBuffer handle, uint32_t count,
                           const VkClearAttachment* attachments, uint32_t rectangles,
                           const VkClearRect* rectangle) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    if (!buffer.drawing.target.texels || count != 1)
        return buffer.fail("vkCmdClearAttachments: expected one attachment that is drawn to");
    record(buffer, [&] {
        ClearRectangles made{
            buffer.drawing.target,
            texel_of(buffer.drawing.target.format, attachments[0].clearValue.color),
            {}};
        for (uint32_t i = 0; i < rectangles; ++i)
            made.rectangles.push_back(rectangle[i].rect);
        return made;
    });
}

// Positions are in pixels of the whole target, which the interface's viewport is.
void vkCmdSetViewport(VkCommandBuffer handle, uint32_t first, uint32_t count,
                      const VkViewport* viewport) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    const native::Image& target = buffer.drawing.target;
    if (first != 0 || count != 1 || viewport->x != 0.0f || viewport->y != 0.0f ||
        viewport->width != static_cast<float>(target.width) ||
        viewport->height != static_cast<float>(target.height))
        buffer.fail("vkCmdSetViewport: expected the image that is drawn to");
}

void vkCmdSetScissor(VkCommandBuffer handle, uint32_t, uint32_t, const VkRect2D* scissor) {
    of<CommandBuffer>(handle)->drawing.scissor = *scissor;
}

void vkCmdBindVertexBuffers(VkCommandBuffer handle, uint32_t first, uint32_t count,
                            const VkBuffer* buffers, const VkDeviceSize* offsets) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    if (first != 0 || count != 1)
        return buffer.fail("vkCmdBindVertexBuffers: expected one buffer");
    buffer.drawing.vertices = of<Buffer>(buffers[0]);
    buffer.drawing.vertex_offset = offsets[0];
}

void vkCmdBindIndexBuffer(VkCommandBuffer handle, VkBuffer indices, VkDeviceSize offset,
                          VkIndexType type) {
    Drawing& drawing = of<CommandBuffer>(handle)->drawing;
    drawing.indices = of<Buffer>(indices);
    drawing.index_offset = offset;
    drawing.has_long_indices = type == VK_INDEX_TYPE_UINT32;
}

void vkCmdDrawIndexed(VkCommandBuffer handle, uint32_t count, uint32_t instances,
                      uint32_t first_index, int32_t first_vertex, uint32_t) {
    CommandBuffer& buffer = *of<CommandBuffer>(handle);
    const Drawing& drawing = buffer.drawing;
    if (!drawing.target.texels || !drawing.pipeline || !drawing.vertices || !drawing.indices ||
        !drawing.set || drawing.set->slots.size() != 1 || !drawing.set->slots[0].is_written ||
        instances != 1)
        return buffer.fail(
            "vkCmdDrawIndexed: expected a target, a pipeline, vertices, indices and a texture, "
            "once");
    const Resource& texture = drawing.set->slots[0].resource;
    if (texture.image.format != VK_FORMAT_R8G8B8A8_UNORM)
        return buffer.fail("vkCmdDrawIndexed: expected a texture of R8G8B8A8_UNORM");
    record(buffer, [&] {
        DrawTriangles made{.target = drawing.target,
                           .texture = texture,
                           .size_px = {},
                           .scissor = drawing.scissor,
                           .vertices = drawing.vertices,
                           .indices = drawing.indices,
                           .vertex_offset = drawing.vertex_offset,
                           .index_offset = drawing.index_offset,
                           .has_long_indices = drawing.has_long_indices,
                           .first_index = first_index,
                           .count = count,
                           .first_vertex = first_vertex};
        std::memcpy(made.size_px.data(), buffer.push_constants.data(), sizeof made.size_px);
        return made;
    });
}

} // namespace api
} // namespace driver

void know_triangles(uint64_t vertex_hash, uint64_t fragment_hash) {
    driver::known_vertex_hash = vertex_hash;
    driver::known_fragment_hash = fragment_hash;
}

} // namespace palpate::native
