#include "engine/gpu/commands.h"

#include <volk.h>

#include <algorithm>
#include <string_view>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/gpu/error.h"

namespace palpate {

namespace {

constexpr uint32_t kMaxPasses = 64;

VkImageSubresourceLayers layers_of(const Commands::Region& region) {
    return {VK_IMAGE_ASPECT_COLOR_BIT, 0, region.first_layer, region.layers};
}

constexpr const char* kUpload = "upload";
constexpr const char* kReadBack = "read back";

uint64_t bytes_of(const GpuImage& image, std::span<const Commands::Region> regions) {
    uint64_t texels = 0;
    for (const auto& r : regions)
        texels += uint64_t{r.size.x} * r.size.y * r.size.z * r.layers;
    return texels * bytes_per_texel(image.shape().format);
}

std::vector<VkBufferImageCopy> to_vulkan(std::span<const Commands::Region> regions) {
    std::vector<VkBufferImageCopy> copies;
    for (const auto& r : regions)
        copies.push_back(
            {r.buffer_offset,
             r.row_texels,
             r.plane_rows,
             layers_of(r),
             {static_cast<int32_t>(r.image_offset.x), static_cast<int32_t>(r.image_offset.y),
              static_cast<int32_t>(r.image_offset.z)},
             {r.size.x, r.size.y, r.size.z}});
    return copies;
}

} // namespace

Commands::Commands(GpuDevice& device) : device_(&device) {
    const VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                       .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                       .queueFamilyIndex = device.queue_family()};
    check(vkCreateCommandPool(device.handle(), &pool, nullptr, &pool_), "creating a command pool");
    const VkCommandBufferAllocateInfo allocate{
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = pool_,
        .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = 1};
    check(vkAllocateCommandBuffers(device.handle(), &allocate, &buffer_), "allocating commands");
    const VkQueryPoolCreateInfo queries{.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                        .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                        .queryCount = 2 * kMaxPasses};
    check(vkCreateQueryPool(device.handle(), &queries, nullptr, &queries_), "creating timestamps");
    const VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                         .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    check(vkBeginCommandBuffer(buffer_, &begin), "beginning commands");
    vkCmdResetQueryPool(buffer_, queries_, 0, 2 * kMaxPasses);
}

Commands::~Commands() {
    device_->retire([device = device_->handle(), pool = pool_, queries = queries_,
                     descriptors = std::move(descriptor_pools_)] {
        for (const VkDescriptorPool p : descriptors)
            vkDestroyDescriptorPool(device, p, nullptr);
        vkDestroyQueryPool(device, queries, nullptr);
        vkDestroyCommandPool(device, pool, nullptr);
    });
}

void Commands::begin_pass(const std::string& name) {
    if (device_->labels_commands()) {
        const VkDebugUtilsLabelEXT label{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT,
                                         .pLabelName = name.c_str()};
        vkCmdBeginDebugUtilsLabelEXT(buffer_, &label);
    }
    begin_stamp({name});
    in_pass_ = true;
}

void Commands::end_pass() {
    end_stamp();
    in_pass_ = false;
    if (device_->labels_commands())
        vkCmdEndDebugUtilsLabelEXT(buffer_);
}

void Commands::begin_stamp(Pass pass) {
    PALPATE_ASSERT_CMP(passes_.size(), <, size_t{kMaxPasses});
    vkCmdWriteTimestamp2(buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_,
                         static_cast<uint32_t>(2 * passes_.size()));
    passes_.push_back(std::move(pass));
}

void Commands::end_stamp() {
    vkCmdWriteTimestamp2(buffer_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_,
                         static_cast<uint32_t>(2 * passes_.size() - 1));
}

void Commands::begin_copy(const char* name, const GpuImage& image,
                          std::span<const Region> regions) {
    const uint64_t bytes = bytes_of(image, regions);
    GpuDevice::Traffic& traffic = device_->traffic();
    const bool upload = std::string_view(name) == kUpload;
    (upload ? traffic.uploads : traffic.read_backs) += 1;
    (upload ? traffic.uploaded_bytes : traffic.read_back_bytes) += bytes;
    timing_copy_ = profile::on() && !in_pass_ && passes_.size() < kMaxPasses;
    if (timing_copy_)
        begin_stamp({name, bytes});
}

void Commands::end_copy() {
    if (timing_copy_)
        end_stamp();
}

void Commands::use(GpuImage& image, Use use) {
    const auto needed = image.tracker().advance(use);
    if (!needed)
        return;
    const VkImageMemoryBarrier2 image_barrier{
        .sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
        .srcStageMask = needed->before.stages,
        .srcAccessMask = needed->before.access,
        .dstStageMask = needed->after.stages,
        .dstAccessMask = needed->after.access,
        .oldLayout = needed->before.layout,
        .newLayout = needed->after.layout,
        .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
        .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
        .image = image.handle(),
        .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS}};
    barrier({.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
             .imageMemoryBarrierCount = 1,
             .pImageMemoryBarriers = &image_barrier});
}

void Commands::use(Buffer& buffer, Use use) {
    const auto needed = buffer.tracker().advance(use);
    if (!needed)
        return;
    const VkBufferMemoryBarrier2 buffer_barrier{.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER_2,
                                                .srcStageMask = needed->before.stages,
                                                .srcAccessMask = needed->before.access,
                                                .dstStageMask = needed->after.stages,
                                                .dstAccessMask = needed->after.access,
                                                .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                                .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                                .buffer = buffer.handle(),
                                                .size = VK_WHOLE_SIZE};
    barrier({.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
             .bufferMemoryBarrierCount = 1,
             .pBufferMemoryBarriers = &buffer_barrier});
}

void Commands::barrier(const VkDependencyInfo& info) {
    vkCmdPipelineBarrier2(buffer_, &info);
}

void Commands::bind(const ComputePipeline& pipeline, std::span<const Bound> bound) {
    PALPATE_ASSERT_CMP(bound.size(), ==, pipeline.slots().size());
    std::vector<VkDescriptorPoolSize> sizes;
    for (const BindingSlot& slot : pipeline.slots())
        sizes.push_back({slot.type, 1});
    const VkDescriptorPoolCreateInfo create{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                            .maxSets = 1,
                                            .poolSizeCount = static_cast<uint32_t>(sizes.size()),
                                            .pPoolSizes = sizes.data()};
    VkDescriptorPool pool = VK_NULL_HANDLE;
    check(vkCreateDescriptorPool(device_->handle(), &create, nullptr, &pool), "creating bindings");
    descriptor_pools_.push_back(pool);
    const VkDescriptorSetLayout layout = pipeline.set_layout();
    const VkDescriptorSetAllocateInfo allocate{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
        .descriptorPool = pool,
        .descriptorSetCount = 1,
        .pSetLayouts = &layout};
    VkDescriptorSet set = VK_NULL_HANDLE;
    check(vkAllocateDescriptorSets(device_->handle(), &allocate, &set), "allocating bindings");

    std::vector<VkDescriptorBufferInfo> buffers(bound.size());
    std::vector<VkDescriptorImageInfo> images(bound.size());
    std::vector<VkWriteDescriptorSet> writes;
    for (size_t i = 0; i < bound.size(); ++i) {
        const Bound& b = bound[i];
        const BindingSlot& slot = pipeline.slots()[i];
        PALPATE_ASSERT_CMP(b.binding, ==, slot.binding);
        VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                   .dstSet = set,
                                   .dstBinding = b.binding,
                                   .descriptorCount = 1,
                                   .descriptorType = slot.type};
        if (auto* const* buffer = std::get_if<Buffer*>(&b.resource)) {
            use(**buffer, b.use);
            buffers[i] = {(*buffer)->handle(), 0, VK_WHOLE_SIZE};
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
        std::string& names = passes_.back().first_uses;
        names += (names.empty() ? "" : ", ") + pipeline.name();
    }
    vkCmdBindPipeline(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
    vkCmdBindDescriptorSets(buffer_, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), 0, 1, &set,
                            0, nullptr);
}

void Commands::dispatch(const ComputePipeline& pipeline, std::span<const Bound> bound,
                        glm::uvec3 groups, glm::uvec3 first_group) {
    bind(pipeline, bound);
    vkCmdDispatchBase(buffer_, first_group.x, first_group.y, first_group.z, groups.x, groups.y,
                      groups.z);
}

void Commands::dispatch_indirect(const ComputePipeline& pipeline, std::span<const Bound> bound,
                                 Buffer& groups, uint32_t first_word) {
    use(groups, Use::indirect);
    bind(pipeline, bound);
    vkCmdDispatchIndirect(buffer_, groups.handle(), first_word * sizeof(uint32_t));
}

void Commands::clear(GpuImage& image, glm::vec4 value) {
    use(image, Use::clear_target);
    const VkClearColorValue color{.float32 = {value.x, value.y, value.z, value.w}};
    const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0,
                                      VK_REMAINING_ARRAY_LAYERS};
    vkCmdClearColorImage(buffer_, image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &color, 1,
                         &all);
}

void Commands::zero(Buffer& buffer) {
    use(buffer, Use::clear_target);
    vkCmdFillBuffer(buffer_, buffer.handle(), 0, VK_WHOLE_SIZE, 0);
}

void Commands::fill(Buffer& buffer, std::span<const uint32_t> words) {
    use(buffer, Use::clear_target);
    vkCmdUpdateBuffer(buffer_, buffer.handle(), 0, words.size_bytes(), words.data());
}

void Commands::copy(GpuImage& from, GpuImage& to) {
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    const ImageShape& shape = from.shape();
    const bool is_3d = shape.type == VK_IMAGE_TYPE_3D;
    const VkImageSubresourceLayers layers{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0,
                                          is_3d ? 1 : shape.layers};
    const VkImageCopy all{.srcSubresource = layers,
                          .dstSubresource = layers,
                          .extent = {shape.size.x, shape.size.y, is_3d ? shape.size.z : 1}};
    vkCmdCopyImage(buffer_, from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &all);
}

void Commands::copy(Buffer& from, GpuImage& to, std::span<const Region> regions) {
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    const auto copies = to_vulkan(regions);
    begin_copy(kUpload, to, regions);
    vkCmdCopyBufferToImage(buffer_, from.handle(), to.handle(),
                           VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                           static_cast<uint32_t>(copies.size()), copies.data());
    end_copy();
}

void Commands::copy(GpuImage& from, Buffer& to, std::span<const Region> regions) {
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    const auto copies = to_vulkan(regions);
    begin_copy(kReadBack, from, regions);
    vkCmdCopyImageToBuffer(buffer_, from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                           to.handle(), static_cast<uint32_t>(copies.size()), copies.data());
    end_copy();
    use(to, Use::host_read);
}

void Commands::copy(Buffer& from, Buffer& to) {
    PALPATE_ASSERT_CMP(from.bytes(), <=, to.bytes());
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    const VkBufferCopy all{0, 0, from.bytes()};
    vkCmdCopyBuffer(buffer_, from.handle(), to.handle(), 1, &all);
    use(to, Use::host_read);
}

void Commands::copy(Buffer& from, Buffer& to, std::span<const Bytes> pieces) {
    PALPATE_ASSERT(!pieces.empty());
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    std::vector<VkBufferCopy> copies;
    for (const Bytes& piece : pieces)
        copies.push_back({piece.from, piece.to, piece.count});
    vkCmdCopyBuffer(buffer_, from.handle(), to.handle(), static_cast<uint32_t>(copies.size()),
                    copies.data());
}

uint64_t Commands::submit() {
    check(vkEndCommandBuffer(buffer_), "ending commands");
    if (profile::on())
        submitted_ns_ = profile::now_ns();
    submitted_ = device_->submit(buffer_);
    return submitted_;
}

std::vector<PassTime> Commands::finish() {
    PALPATE_ASSERT(submitted_ > 0);
    device_->wait(submitted_);
    const int64_t finished_ns = profile::on() ? profile::now_ns() : 0;
    std::vector<PassTime> times;
    if (passes_.empty())
        return times;
    std::vector<uint64_t> stamps(2 * passes_.size());
    check(
        vkGetQueryPoolResults(device_->handle(), queries_, 0, static_cast<uint32_t>(stamps.size()),
                              stamps.size() * 8, stamps.data(), 8,
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "reading timestamps");
    const double ms_per_tick = static_cast<double>(device_->limits().timestampPeriod) * 1e-6;
    for (size_t i = 0; i < passes_.size(); ++i)
        if (passes_[i].copied_bytes == 0)
            times.push_back({passes_[i].name,
                             static_cast<double>(stamps[2 * i + 1] - stamps[2 * i]) * ms_per_tick});
    if (profile::on() && submitted_ns_ > 0)
        profile_passes(stamps, finished_ns);
    return times;
}

// Times are those of the CPU's clock: as calibrated, or so that the last pass ends when the wait
// for it did. Work lies between its submission and the end of the wait, so what rounding or
// calibration move beyond is moved back.
void Commands::profile_passes(std::span<const uint64_t> stamps, int64_t finished_ns) const {
    const double ns_per_tick = static_cast<double>(device_->limits().timestampPeriod);
    const int64_t last_ns = device_->cpu_ns_of(stamps.back()).value_or(finished_ns);
    const auto cpu_ns = [&](uint64_t stamp) {
        const double before = static_cast<double>(stamps.back() - stamp) * ns_per_tick;
        return std::clamp(last_ns - static_cast<int64_t>(before), submitted_ns_, finished_ns);
    };
    for (size_t i = 0; i < passes_.size(); ++i) {
        const Pass& pass = passes_[i];
        const int64_t from = cpu_ns(stamps[2 * i]);
        const int64_t to = std::max(from, cpu_ns(stamps[2 * i + 1]));
        if (pass.copied_bytes > 0) {
            profile::add(profile::Track::copies, pass.name, from, to,
                         {{"bytes", Json::of(static_cast<double>(pass.copied_bytes))}});
            continue;
        }
        const double gpu_ms =
            static_cast<double>(stamps[2 * i + 1] - stamps[2 * i]) * ns_per_tick * 1e-6;
        profile::add(profile::Track::passes, pass.name, from, to, {{"gpu_ms", Json::of(gpu_ms)}});
        if (!pass.first_uses.empty())
            profile::add(profile::Track::compile, pass.first_uses, from, to);
    }
}

} // namespace palpate
