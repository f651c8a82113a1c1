#include "apps/view/drawing/ui_drawing.h"

#include <fmt/format.h>
#include <imgui/imgui.h>
#include <volk.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>

#include "engine/gpu/error.h"
#include "engine/native/driver/triangles.h"
#include "engine/native/kernel.h"
#include "spirv/interface_frag.h"
#include "spirv/interface_vert.h"

namespace palpate::view {

namespace {

constexpr uint32_t kMostPictures = 256; // with those that the device may still read

uint64_t new_version() {
    static std::atomic<uint64_t> last = 0;
    return ++last;
}

VkRect2D rectangle(glm::ivec2 low, glm::ivec2 high) {
    return {{low.x, low.y},
            {static_cast<uint32_t>(high.x - low.x), static_cast<uint32_t>(high.y - low.y)}};
}

VkShaderModule module_of(GpuDevice& device, const Shader& shader) {
    const std::span<const uint32_t> words = shader.code->words;
    const VkShaderModuleCreateInfo create{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                          .codeSize = words.size_bytes(),
                                          .pCode = words.data()};
    VkShaderModule module = VK_NULL_HANDLE;
    check(vkCreateShaderModule(device.handle(), &create, nullptr, &module),
          "creating the shader of the interface");
    return module;
}

VkPipeline make_pipeline(GpuDevice& device, VkPipelineLayout layout, VkFormat format) {
    native::know_triangles(native::hash_of(Shader(spirv::InterfaceVert{}).code->words),
                           native::hash_of(Shader(spirv::InterfaceFrag{}).code->words));
    const VkShaderModule vertex = module_of(device, spirv::InterfaceVert{});
    const VkShaderModule fragment = module_of(device, spirv::InterfaceFrag{});
    const std::array stages{VkPipelineShaderStageCreateInfo{
                                .sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                .stage = VK_SHADER_STAGE_VERTEX_BIT,
                                .module = vertex,
                                .pName = "main"},
                            VkPipelineShaderStageCreateInfo{
                                .sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                .stage = VK_SHADER_STAGE_FRAGMENT_BIT,
                                .module = fragment,
                                .pName = "main"}};
    const VkVertexInputBindingDescription binding{0, sizeof(ImDrawVert),
                                                  VK_VERTEX_INPUT_RATE_VERTEX};
    const std::array attributes{
        VkVertexInputAttributeDescription{0, 0, VK_FORMAT_R32G32_SFLOAT, offsetof(ImDrawVert, pos)},
        VkVertexInputAttributeDescription{1, 0, VK_FORMAT_R32G32_SFLOAT, offsetof(ImDrawVert, uv)},
        VkVertexInputAttributeDescription{2, 0, VK_FORMAT_R8G8B8A8_UNORM,
                                          offsetof(ImDrawVert, col)}};
    const VkPipelineVertexInputStateCreateInfo input{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO,
        .vertexBindingDescriptionCount = 1,
        .pVertexBindingDescriptions = &binding,
        .vertexAttributeDescriptionCount = attributes.size(),
        .pVertexAttributeDescriptions = attributes.data()};
    const VkPipelineInputAssemblyStateCreateInfo assembly{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
        .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST};
    const VkPipelineViewportStateCreateInfo viewport{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO,
        .viewportCount = 1,
        .scissorCount = 1};
    const VkPipelineRasterizationStateCreateInfo raster{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO,
        .polygonMode = VK_POLYGON_MODE_FILL,
        .cullMode = VK_CULL_MODE_NONE,
        .lineWidth = 1.0f};
    const VkPipelineMultisampleStateCreateInfo samples{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
        .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
    const VkPipelineColorBlendAttachmentState over{
        .blendEnable = VK_TRUE,
        .srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA,
        .dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
        .colorBlendOp = VK_BLEND_OP_ADD,
        .srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE,
        .dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
        .alphaBlendOp = VK_BLEND_OP_ADD,
        .colorWriteMask = 0xf};
    const VkPipelineColorBlendStateCreateInfo blend{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
        .attachmentCount = 1,
        .pAttachments = &over};
    const std::array dynamic{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
    const VkPipelineDynamicStateCreateInfo dynamics{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
        .dynamicStateCount = dynamic.size(),
        .pDynamicStates = dynamic.data()};
    const VkPipelineRenderingCreateInfo rendering{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
        .colorAttachmentCount = 1,
        .pColorAttachmentFormats = &format};
    const VkGraphicsPipelineCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
        .pNext = &rendering,
        .stageCount = stages.size(),
        .pStages = stages.data(),
        .pVertexInputState = &input,
        .pInputAssemblyState = &assembly,
        .pViewportState = &viewport,
        .pRasterizationState = &raster,
        .pMultisampleState = &samples,
        .pColorBlendState = &blend,
        .pDynamicState = &dynamics,
        .layout = layout};
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult made =
        vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &create, nullptr, &pipeline);
    vkDestroyShaderModule(device.handle(), vertex, nullptr);
    vkDestroyShaderModule(device.handle(), fragment, nullptr);
    check(made, "creating the pipeline of the interface");
    return pipeline;
}

} // namespace

UiDrawing::UiDrawing(GpuDevice& device, VkFormat format)
    : device_(&device),
      linear_(device, SampleFilter::linear, Edge::clamp),
      nearest_(device, SampleFilter::nearest, Edge::clamp),
      format_(format) {
    const VkDescriptorSetLayoutBinding binding{
        .binding = 0,
        .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
        .descriptorCount = 1,
        .stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT};
    const VkDescriptorSetLayoutCreateInfo sets{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = 1,
        .pBindings = &binding};
    check(vkCreateDescriptorSetLayout(device.handle(), &sets, nullptr, &set_layout_),
          "creating the bindings of the interface");
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, kMostPictures};
    const VkDescriptorPoolCreateInfo pool{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
        .flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT,
        .maxSets = kMostPictures,
        .poolSizeCount = 1,
        .pPoolSizes = &size};
    check(vkCreateDescriptorPool(device.handle(), &pool, nullptr, &pool_),
          "creating the bindings of the interface");
    const VkPushConstantRange push{VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof(glm::vec2)};
    const VkPipelineLayoutCreateInfo layout{.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                            .setLayoutCount = 1,
                                            .pSetLayouts = &set_layout_,
                                            .pushConstantRangeCount = 1,
                                            .pPushConstantRanges = &push};
    check(vkCreatePipelineLayout(device.handle(), &layout, nullptr, &layout_),
          "creating the layout of the interface");
    pipeline_ = make_pipeline(device, layout_, format);
    const VkCommandPoolCreateInfo slots{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                        .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                        .queueFamilyIndex = device.queue_family()};
    check(vkCreateCommandPool(device.handle(), &slots, nullptr, &slots_pool_),
          "creating the commands of the interface");
    for (Slot& slot : slots_) {
        const VkCommandBufferAllocateInfo allocate{
            .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
            .commandPool = slots_pool_,
            .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
            .commandBufferCount = 1};
        const VkFenceCreateInfo fence{.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO,
                                      .flags = VK_FENCE_CREATE_SIGNALED_BIT};
        check(vkAllocateCommandBuffers(device.handle(), &allocate, &slot.commands),
              "creating the commands of the interface");
        check(vkCreateFence(device.handle(), &fence, nullptr, &slot.done),
              "creating the commands of the interface");
    }

    unsigned char* texels = nullptr;
    int width = 0, height = 0;
    ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&texels, &width, &height);
    ImGui::GetIO().Fonts->SetTexID(nullptr);
    Commands commands(device);
    set_picture(commands, 0, glm::uvec2(width, height),
                std::as_bytes(std::span(
                    texels, size_t{4} * static_cast<size_t>(width) * static_cast<size_t>(height))));
    commands.submit();
}

UiDrawing::~UiDrawing() {
    device_->wait_idle();
    for (const Slot& slot : slots_)
        vkDestroyFence(device_->handle(), slot.done, nullptr);
    vkDestroyCommandPool(device_->handle(), slots_pool_, nullptr);
    pictures_.clear();
    device_->retire([device = device_->handle(), pipeline = pipeline_, layout = layout_,
                     pool = pool_, sets = set_layout_] {
        vkDestroyPipeline(device, pipeline, nullptr);
        vkDestroyPipelineLayout(device, layout, nullptr);
        vkDestroyDescriptorPool(device, pool, nullptr);
        vkDestroyDescriptorSetLayout(device, sets, nullptr);
    });
}

void UiDrawing::drop(uint32_t number) {
    const auto found = pictures_.find(number);
    if (found == pictures_.end())
        return;
    device_->retire(
        [device = device_->handle(), pool = pool_, set = found->second.set,
         image = std::move(found->second.image)] { vkFreeDescriptorSets(device, pool, 1, &set); });
    pictures_.erase(found);
}

void UiDrawing::set_picture(uint32_t number, std::shared_ptr<GpuImage> image) {
    drop(number);
    Picture picture{std::move(image), VK_NULL_HANDLE, new_version()};
    const VkDescriptorSetAllocateInfo allocate{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
        .descriptorPool = pool_,
        .descriptorSetCount = 1,
        .pSetLayouts = &set_layout_};
    check(vkAllocateDescriptorSets(device_->handle(), &allocate, &picture.set),
          "binding a picture of the interface");
    const VkDescriptorImageInfo shown{(number == 0 ? linear_ : nearest_).handle(),
                                      picture.image->view(),
                                      VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    const VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                     .dstSet = picture.set,
                                     .dstBinding = 0,
                                     .descriptorCount = 1,
                                     .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                     .pImageInfo = &shown};
    vkUpdateDescriptorSets(device_->handle(), 1, &write, 0, nullptr);
    pictures_.emplace(number, std::move(picture));
}

void UiDrawing::drop_pictures() {
    while (pictures_.size() > 1)
        drop(pictures_.rbegin()->first);
    device_->wait(device_->last_submitted());
}

void UiDrawing::set_picture(Commands& commands, uint32_t number, glm::uvec2 size_px,
                            std::span<const std::byte> rgba) {
    const auto found = pictures_.find(number);
    if (found == pictures_.end() || glm::uvec2(found->second.image->shape().size) != size_px)
        set_picture(number, std::make_shared<GpuImage>(
                                *device_, fmt::format("interface picture {}", number),
                                ImageShape{.format = VK_FORMAT_R8G8B8A8_UNORM,
                                           .size = glm::uvec3(size_px, 1)}));
    pictures_.at(number).version = new_version();
    const BufferSlice staged = commands.upload(rgba);
    const Commands::Region all{0, glm::uvec3(0), glm::uvec3(size_px, 1)};
    commands.copy(staged, *pictures_.at(number).image, std::span(&all, 1));
}

UiDrawing::Slot& UiDrawing::next_slot() {
    slot_ = (slot_ + 1) % slots_.size();
    Slot& slot = slots_[slot_];
    check(vkWaitForFences(device_->handle(), 1, &slot.done, VK_TRUE, UINT64_MAX),
          "waiting for the interface");
    check(vkResetFences(device_->handle(), 1, &slot.done), "drawing the interface");
    const VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                         .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    check(vkBeginCommandBuffer(slot.commands, &begin), "drawing the interface");
    return slot;
}

// Finds the boxes in which the kept image differs from the lists.
std::vector<Box> UiDrawing::find_changes(const ImDrawData& data, glm::uvec2 size_px) {
    if (!kept_ || glm::uvec2(kept_->shape().size) != size_px) {
        kept_.reset();
        kept_.emplace(
            *device_, "interface",
            ImageShape{.format = format_, .size = glm::uvec3(size_px, 1), .attachment = true});
        tiles_ = {};
    }
    UiTiles tiles = tiles_of(data, [this](uint32_t number) {
        const auto found = pictures_.find(number);
        return found == pictures_.end() ? 0 : found->second.version;
    });
    const UiTiles before = std::exchange(tiles_, std::move(tiles));
    if (tiles_.size_px == glm::ivec2(size_px))
        return changes(before, tiles_);
    forget(); // laid out for another size: drawn as large as the target is
    return {{glm::ivec2(0), glm::ivec2(size_px)}};
}

void UiDrawing::record(Commands& commands, UiTarget& target, const ImDrawData& data) {
    const glm::uvec2 size(target.image.shape().size);
    const std::vector<Box> boxes = find_changes(data, size);
    if (!boxes.empty()) {
        const Triangles triangles = upload(commands, data);
        for (auto& [number, picture] : pictures_)
            commands.use(*picture.image, Use::sampled);
        commands.use(*kept_, Use::color_attachment);
        commands.flush();
        draw(triangles, data, boxes);
    }
    std::vector<Commands::Area> lacking;
    if (tiles_.size_px != glm::ivec2(size))
        lacking.push_back({glm::uvec2(0), size});
    else
        for (const Box& box : changes(target.shown, tiles_))
            lacking.push_back({glm::uvec2(box.low_px), glm::uvec2(box.size_px)});
    if (!lacking.empty())
        commands.copy(*kept_, target.image, lacking);
    target.shown = tiles_;
}

UiDrawing::Triangles UiDrawing::upload(Commands& commands, const ImDrawData& data) {
    const auto vertex_bytes = static_cast<uint64_t>(data.TotalVtxCount) * sizeof(ImDrawVert);
    const auto index_bytes = static_cast<uint64_t>(data.TotalIdxCount) * sizeof(ImDrawIdx);
    Triangles all{commands.staging(std::max<uint64_t>(vertex_bytes, 4)),
                  commands.staging(std::max<uint64_t>(index_bytes, 4))};
    std::byte *vertices = all.vertices.mapped().data(), *indices = all.indices.mapped().data();
    const auto add = [](std::byte*& to, const void* from, size_t bytes) {
        std::memcpy(to, from, bytes);
        to += bytes;
    };
    for (int i = 0; i < data.CmdListsCount; ++i) {
        const ImDrawList& list = *data.CmdLists[i];
        add(vertices, list.VtxBuffer.Data, static_cast<size_t>(list.VtxBuffer.size_in_bytes()));
        add(indices, list.IdxBuffer.Data, static_cast<size_t>(list.IdxBuffer.size_in_bytes()));
    }
    return all;
}

// Records what is drawn within one rectangle of the target.
void UiDrawing::draw_within(const Box& box, VkCommandBuffer to, const ImDrawData& data) {
    const auto draw = [&](uint32_t number, const ImVec4& clip, uint32_t count, uint32_t first,
                          int32_t vertex) {
        const auto found = pictures_.find(number);
        const glm::ivec2 box_high = box.low_px + box.size_px;
        const glm::ivec2 low = glm::clamp(glm::ivec2(clip.x, clip.y), box.low_px, box_high);
        const glm::ivec2 high = glm::clamp(glm::ivec2(clip.z, clip.w), low, box_high);
        if (found == pictures_.end() || low.x == high.x || low.y == high.y)
            return;
        const VkRect2D scissor = rectangle(low, high);
        vkCmdSetScissor(to, 0, 1, &scissor);
        vkCmdBindDescriptorSets(to, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, 0, 1,
                                &found->second.set, 0, nullptr);
        vkCmdDrawIndexed(to, count, 1, first, vertex, 0);
    };
    int32_t first_vertex = 0;
    uint32_t first_index = 0;
    for (int i = 0; i < data.CmdListsCount; ++i) {
        const ImDrawList& list = *data.CmdLists[i];
        for (const ImDrawCmd& command : list.CmdBuffer)
            draw(static_cast<uint32_t>(reinterpret_cast<uintptr_t>(command.GetTexID())),
                 command.ClipRect, command.ElemCount, first_index + command.IdxOffset,
                 first_vertex + static_cast<int32_t>(command.VtxOffset));
        first_vertex += list.VtxBuffer.Size;
        first_index += static_cast<uint32_t>(list.IdxBuffer.Size);
    }
}

// Draws upon the kept image, in a submission of its own.
void UiDrawing::draw(const Triangles& triangles, const ImDrawData& data,
                     std::span<const Box> boxes) {
    const Slot& slot = next_slot();
    const VkCommandBuffer to = slot.commands;
    // Pictures were made ready for compute shaders; here fragments read them.
    const VkMemoryBarrier2 ready{
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
        .srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
        .srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT,
        .dstStageMask = VK_PIPELINE_STAGE_2_ALL_GRAPHICS_BIT,
        .dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT};
    const VkDependencyInfo dependency{.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
                                      .memoryBarrierCount = 1,
                                      .pMemoryBarriers = &ready};
    vkCmdPipelineBarrier2(to, &dependency);
    const glm::uvec2 size(kept_->shape().size);
    const VkRenderingAttachmentInfo color{.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                          .imageView = kept_->view(),
                                          .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                                          .loadOp = VK_ATTACHMENT_LOAD_OP_LOAD,
                                          .storeOp = VK_ATTACHMENT_STORE_OP_STORE};
    const VkRenderingInfo rendering{.sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                    .renderArea = {{0, 0}, {size.x, size.y}},
                                    .layerCount = 1,
                                    .colorAttachmentCount = 1,
                                    .pColorAttachments = &color};
    vkCmdBeginRendering(to, &rendering);
    vkCmdBindPipeline(to, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_);
    const VkBuffer vertex_buffer = triangles.vertices.buffer->handle();
    const VkDeviceSize vertex_offset = triangles.vertices.offset;
    vkCmdBindVertexBuffers(to, 0, 1, &vertex_buffer, &vertex_offset);
    vkCmdBindIndexBuffer(to, triangles.indices.buffer->handle(), triangles.indices.offset,
                         sizeof(ImDrawIdx) == 2 ? VK_INDEX_TYPE_UINT16 : VK_INDEX_TYPE_UINT32);
    const VkViewport viewport{0.0f, 0.0f, static_cast<float>(size.x), static_cast<float>(size.y),
                              0.0f, 1.0f};
    vkCmdSetViewport(to, 0, 1, &viewport);
    const glm::vec2 pixels(data.DisplaySize.x, data.DisplaySize.y);
    vkCmdPushConstants(to, layout_, VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof(pixels), &pixels);
    constexpr VkClearAttachment kBlack{
        .aspectMask = VK_IMAGE_ASPECT_COLOR_BIT,
        .colorAttachment = 0,
        .clearValue = {.color = {.float32 = {0.0f, 0.0f, 0.0f, 1.0f}}}};
    std::vector<VkClearRect> clears;
    for (const Box& box : boxes)
        clears.push_back({rectangle(box.low_px, box.low_px + box.size_px), 0, 1});
    vkCmdClearAttachments(to, 1, &kBlack, static_cast<uint32_t>(clears.size()), clears.data());
    for (const Box& box : boxes)
        draw_within(box, to, data);
    vkCmdEndRendering(to);
    // A later write to a picture waits for compute shaders, as Commands knows; so does this one.
    const VkMemoryBarrier2 read{.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                                .srcStageMask = VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT,
                                .dstStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT};
    const VkDependencyInfo after{.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
                                 .memoryBarrierCount = 1,
                                 .pMemoryBarriers = &read};
    vkCmdPipelineBarrier2(to, &after);
    check(vkEndCommandBuffer(to), "drawing the interface");
    const VkCommandBufferSubmitInfo submitted{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO,
                                              .commandBuffer = to};
    const VkSubmitInfo2 submit{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                               .commandBufferInfoCount = 1,
                               .pCommandBufferInfos = &submitted};
    const auto turn = device_->queue_turn();
    check(vkQueueSubmit2(device_->queue(), 1, &submit, slot.done), "drawing the interface");
}

} // namespace palpate::view
