#include "engine/gpu/commands.h"

#include <volk.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <string_view>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/gpu/command_slot.h"
#include "engine/gpu/error.h"
#include "engine/gpu/recorded.h"

namespace palpate {

namespace {

// Texels and bytes are brought to the device this many at a time.
constexpr uint64_t kBatchBytes = uint64_t{4} << 20;

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

std::vector<VkBufferImageCopy> to_vulkan(std::span<const Commands::Region> regions,
                                         uint64_t offset) {
    std::vector<VkBufferImageCopy> copies;
    for (const auto& r : regions)
        copies.push_back(
            {offset + r.buffer_offset,
             r.row_texels,
             r.plane_rows,
             layers_of(r),
             {static_cast<int32_t>(r.image_offset.x), static_cast<int32_t>(r.image_offset.y),
              static_cast<int32_t>(r.image_offset.z)},
             {r.size.x, r.size.y, r.size.z}});
    return copies;
}

} // namespace

Commands::Commands(GpuDevice& device)
    : device_(&device), recorded_(std::make_shared<Recorded>(device)) {}

Commands::~Commands() {
    if (recorded_->is_open()) { // tickets wait for nothing more
        recorded_->uploads.give(*device_, recorded_->last_value());
        device_->give_slot(std::move(recorded_->open().slot), 0);
        recorded_->parts.pop_back();
    }
}

CommandSlot& Commands::slot() {
    if (!recorded_->is_open()) {
        PALPATE_ASSERT(!recorded_->submitted);
        recorded_->parts.push_back({device_->take_slot()});
    }
    return *recorded_->open().slot;
}

VkCommandBuffer Commands::handle() {
    return slot().commands();
}

void Commands::begin_pass(const std::string& name) {
    if (recorded_->is_open() && recorded_->open().passes.size() == kMaxPasses)
        flush();
    if (device_->labels_commands()) {
        const VkDebugUtilsLabelEXT label{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT,
                                         .pLabelName = name.c_str()};
        vkCmdBeginDebugUtilsLabelEXT(handle(), &label);
    }
    begin_stamp(name);
    ++pass_count_;
    in_pass_ = true;
}

void Commands::end_pass() {
    end_stamp();
    in_pass_ = false;
    if (device_->labels_commands())
        vkCmdEndDebugUtilsLabelEXT(handle());
}

void Commands::begin_stamp(std::string name) {
    const CommandSlot& into = slot();
    std::vector<Recorded::Pass>& passes = recorded_->open().passes;
    PALPATE_ASSERT_CMP(passes.size(), <, size_t{kMaxPasses});
    vkCmdWriteTimestamp2(into.commands(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, into.queries(),
                         static_cast<uint32_t>(2 * passes.size()));
    passes.push_back({std::move(name)});
}

void Commands::end_stamp() {
    const CommandSlot& into = slot();
    vkCmdWriteTimestamp2(into.commands(), VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, into.queries(),
                         static_cast<uint32_t>(2 * recorded_->open().passes.size() - 1));
}

void Commands::begin_copy(const char* name, uint64_t bytes) {
    GpuDevice::Traffic& traffic = device_->traffic();
    const bool upload = std::string_view(name) == kUpload;
    (upload ? traffic.uploads : traffic.read_backs) += 1;
    (upload ? traffic.uploaded_bytes : traffic.read_back_bytes) += bytes;
    timing_copy_ = profile::on() && !in_pass_;
    if (timing_copy_ && recorded_->is_open())
        timing_copy_ = recorded_->open().passes.size() < kMaxPasses;
    if (timing_copy_) {
        begin_stamp(name);
        recorded_->open().passes.back().for_profile_alone = true;
    }
    if (timing_copy_ || (in_pass_ && recorded_->open().passes.back().name == kUpload))
        recorded_->open().passes.back().copied_bytes += bytes;
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
    vkCmdPipelineBarrier2(handle(), &info);
}

void Commands::dispatch(const ComputePipeline& pipeline, std::span<const Bound> bound,
                        glm::uvec3 groups, glm::uvec3 first_group) {
    bind(pipeline, bound);
    vkCmdDispatchBase(handle(), first_group.x, first_group.y, first_group.z, groups.x, groups.y,
                      groups.z);
}

void Commands::dispatch_indirect(const ComputePipeline& pipeline, std::span<const Bound> bound,
                                 Buffer& groups, uint32_t first_word) {
    use(groups, Use::indirect);
    bind(pipeline, bound);
    vkCmdDispatchIndirect(handle(), groups.handle(), first_word * sizeof(uint32_t));
}

void Commands::clear(GpuImage& image, glm::vec4 value) {
    use(image, Use::clear_target);
    const VkClearColorValue color{.float32 = {value.x, value.y, value.z, value.w}};
    const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0,
                                      VK_REMAINING_ARRAY_LAYERS};
    vkCmdClearColorImage(handle(), image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &color, 1,
                         &all);
}

void Commands::zero(Buffer& buffer) {
    use(buffer, Use::clear_target);
    vkCmdFillBuffer(handle(), buffer.handle(), 0, VK_WHOLE_SIZE, 0);
}

void Commands::fill(Buffer& buffer, std::span<const uint32_t> words) {
    use(buffer, Use::clear_target);
    vkCmdUpdateBuffer(handle(), buffer.handle(), 0, words.size_bytes(), words.data());
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
    vkCmdCopyImage(handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &all);
}

void Commands::copy(GpuImage& from, GpuImage& to, std::span<const Area> areas) {
    PALPATE_ASSERT(!areas.empty() && from.shape().layers == 1 && to.shape().layers == 1);
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    const VkImageSubresourceLayers layer{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    std::vector<VkImageCopy> copies;
    for (const Area& area : areas) {
        const VkOffset3D low{static_cast<int32_t>(area.low.x), static_cast<int32_t>(area.low.y), 0};
        copies.push_back({.srcSubresource = layer,
                          .srcOffset = low,
                          .dstSubresource = layer,
                          .dstOffset = low,
                          .extent = {area.size.x, area.size.y, 1}});
    }
    vkCmdCopyImage(handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(),
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, static_cast<uint32_t>(copies.size()),
                   copies.data());
}

void Commands::copy(BufferSlice from, GpuImage& to, std::span<const Region> regions) {
    use(*from.buffer, Use::copy_source);
    use(to, Use::copy_target);
    const auto copies = to_vulkan(regions, from.offset);
    begin_copy(kUpload, bytes_of(to, regions));
    vkCmdCopyBufferToImage(handle(), from.buffer->handle(), to.handle(),
                           VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                           static_cast<uint32_t>(copies.size()), copies.data());
    end_copy();
}

void Commands::copy(GpuImage& from, BufferSlice to, std::span<const Region> regions) {
    use(from, Use::copy_source);
    use(*to.buffer, Use::copy_target);
    const auto copies = to_vulkan(regions, to.offset);
    begin_copy(kReadBack, bytes_of(from, regions));
    vkCmdCopyImageToBuffer(handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                           to.buffer->handle(), static_cast<uint32_t>(copies.size()),
                           copies.data());
    end_copy();
    use(*to.buffer, Use::host_read);
}

void Commands::copy(BufferSlice from, BufferSlice to) {
    PALPATE_ASSERT_CMP(from.bytes, <=, to.bytes);
    use(*from.buffer, Use::copy_source);
    use(*to.buffer, Use::copy_target);
    const VkBufferCopy all{from.offset, to.offset, from.bytes};
    vkCmdCopyBuffer(handle(), from.buffer->handle(), to.buffer->handle(), 1, &all);
    use(*to.buffer, Use::host_read);
}

void Commands::copy(Buffer& from, Buffer& to, std::span<const Bytes> pieces) {
    PALPATE_ASSERT(!pieces.empty());
    use(from, Use::copy_source);
    use(to, Use::copy_target);
    std::vector<VkBufferCopy> copies;
    uint64_t total = 0;
    for (const Bytes& piece : pieces) {
        copies.push_back({piece.from, piece.to, piece.count});
        total += piece.count;
    }
    const bool upload = from.mapped().data() != nullptr;
    if (upload)
        begin_copy(kUpload, total);
    vkCmdCopyBuffer(handle(), from.handle(), to.handle(), static_cast<uint32_t>(copies.size()),
                    copies.data());
    if (upload)
        end_copy();
}

BufferSlice Commands::staging(uint64_t bytes) {
    return recorded_->uploads.take(*device_, bytes);
}

BufferSlice Commands::upload(std::span<const std::byte> bytes) {
    const BufferSlice slice = staging(bytes.size());
    std::memcpy(slice.mapped().data(), bytes.data(), bytes.size());
    return slice;
}

void Commands::in_batches(size_t pieces, uint64_t piece_bytes,
                          const std::function<void(size_t first, size_t count)>& record) {
    const size_t batch = std::max<uint64_t>(1, kBatchBytes / piece_bytes);
    std::deque<size_t> sent; // parts on their way
    for (size_t first = 0; first < pieces; first += batch) {
        if (first > 0) {
            sent.push_back(recorded_->parts.size() - 1);
            flush();
        }
        if (sent.size() == 2) { // one is filled while the device copies another
            Recorded::Part& oldest = recorded_->parts[sent.front()];
            device_->wait(oldest.value);
            recorded_->read_times(oldest);
            device_->give_slot(std::move(oldest.slot), oldest.value);
            sent.pop_front();
        }
        record(first, std::min(batch, pieces - first));
    }
}

void Commands::upload(std::span<const std::byte> bytes, Buffer& to, uint64_t first) {
    in_batches(bytes.size(), 1, [&](size_t at, size_t count) {
        const BufferSlice from = slot().batch().take(*device_, count);
        std::memcpy(from.mapped().data(), bytes.data() + at, count);
        begin_pass(kUpload);
        begin_copy(kUpload, count);
        copy(from, {to, first + at, count});
        end_copy();
        end_pass();
    });
}

void Commands::upload(GpuImage& to, size_t pieces, uint64_t piece_bytes, const Fill& fill) {
    in_batches(pieces, piece_bytes, [&](size_t at, size_t count) {
        const BufferSlice from = slot().batch().take(*device_, count * piece_bytes);
        const std::vector<Region> regions = fill(at, count, from.mapped());
        begin_pass(kUpload);
        copy(from, to, regions);
        end_pass();
    });
}

BufferSlice Commands::read_back(Buffer& from) {
    const BufferSlice to = recorded_->read_backs.take(*device_, from.bytes());
    copy(from, to);
    return to;
}

BufferSlice Commands::read_back(GpuImage& from, std::span<const Region> regions, uint64_t bytes) {
    const BufferSlice to = recorded_->read_backs.take(*device_, bytes);
    copy(from, to, regions);
    return to;
}

void Commands::submit_open(std::span<const SemaphoreUse> signals) {
    PALPATE_ASSERT(!in_pass_);
    if (!recorded_->is_open())
        return;
    Recorded::Part& part = recorded_->open();
    check(vkEndCommandBuffer(part.slot->commands()), "ending commands");
    if (profile::on())
        part.submitted_ns = profile::now_ns();
    part.value = device_->submit(*part.slot, waits_, signals);
    waits_.clear();
}

uint64_t Commands::submit() {
    slot(); // also of nothing
    submit_open(signals_);
    recorded_->submitted = true;
    recorded_->uploads.give(*device_, recorded_->parts.back().value);
    return recorded_->parts.back().value;
}

std::vector<PassTime> Commands::finish() {
    return ticket().times();
}

} // namespace palpate
