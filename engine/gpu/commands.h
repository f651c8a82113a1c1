#pragma once

#include <vulkan/vulkan_core.h>

#include <glm/glm.hpp>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "engine/gpu/resource.h"

namespace palpate {

// What a shader's binding is tied to for one dispatch.
struct Bound {
    uint32_t binding;
    Use use;
    std::variant<Buffer*, GpuImage*> resource;
    const Sampler* sampler = nullptr;
};
inline Bound bind_uniform(uint32_t binding, Buffer& buffer) {
    return {binding, Use::uniform, &buffer};
}
inline Bound bind_storage(uint32_t binding, Buffer& buffer, Use use = Use::storage_read) {
    return {binding, use, &buffer};
}
inline Bound bind_sampled(uint32_t binding, GpuImage& image, const Sampler& sampler) {
    return {binding, Use::sampled, &image, &sampler};
}
inline Bound bind_storage_image(uint32_t binding, GpuImage& image) {
    return {binding, Use::storage_write, &image};
}

struct PassTime {
    std::string name;
    double gpu_ms; // between two timestamps round the pass
};

// Records one submission: passes in a list, with the barriers their uses need. Used once.
class Commands {
 public:
    explicit Commands(GpuDevice& device);
    ~Commands();
    Commands(const Commands&) = delete;
    Commands& operator=(const Commands&) = delete;

    // Names what follows, in captures and in the times that finish() returns.
    void begin_pass(const std::string& name);
    void end_pass();

    void use(GpuImage& image, Use use);
    void use(Buffer& buffer, Use use);

    // `bound` covers every slot of the pipeline; uses are tracked here. Workgroup numbers start at
    // `first_group`.
    void dispatch(const ComputePipeline& pipeline, std::span<const Bound> bound, glm::uvec3 groups,
                  glm::uvec3 first_group = {});

    // The same with the group counts (three uint32) that `groups` holds when the GPU gets there.
    void dispatch_indirect(const ComputePipeline& pipeline, std::span<const Bound> bound,
                           Buffer& groups, uint32_t first_word = 0);

    // Sets every texel of a colour image.
    void clear(GpuImage& image, glm::vec4 value);
    // Sets every byte of a buffer to 0; its size is a multiple of four.
    void zero(Buffer& buffer);
    // Sets the first bytes of a buffer; at most 64 KiB.
    void fill(Buffer& buffer, std::span<const uint32_t> words);

    // Regions of texels from a tightly packed buffer: rows of row_texels, planes of plane_rows
    // rows.
    struct Region {
        uint64_t buffer_offset;
        glm::uvec3 image_offset, size;
        uint32_t row_texels = 0, plane_rows = 0; // 0: as wide and high as `size`
        uint32_t first_layer = 0, layers = 1;
    };
    void copy(Buffer& from, GpuImage& to, std::span<const Region> regions);
    void copy(GpuImage& from, Buffer& to, std::span<const Region> regions);
    void copy(GpuImage& from, GpuImage& to); // all of it; both have one shape
    void copy(Buffer& from, Buffer& to);     // all of it; `to` is no smaller
    struct Bytes {
        uint64_t from, to, count; // the first byte in either
    };
    void copy(Buffer& from, Buffer& to, std::span<const Bytes> pieces); // one or more

    // Hands the work over and returns at once; the timeline value to wait for.
    uint64_t submit();

    // Waits for submit()'s work and returns the time of each pass. While a profile is recorded the
    // passes go there too, and every copy as one more.
    std::vector<PassTime> finish();

 private:
    struct Pass {
        std::string name;
        uint64_t copied_bytes = 0;   // of a copy that is timed for the profile alone
        std::string first_uses = {}; // pipelines that had not been dispatched before
    };

    void bind(const ComputePipeline& pipeline, std::span<const Bound> bound);
    void barrier(const VkDependencyInfo& info);
    void begin_stamp(Pass pass);
    void end_stamp();
    void begin_copy(const char* name, const GpuImage& image, std::span<const Region> regions);
    void end_copy();
    void profile_passes(std::span<const uint64_t> stamps, int64_t finished_ns) const;

    GpuDevice* device_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer buffer_ = VK_NULL_HANDLE;
    VkQueryPool queries_ = VK_NULL_HANDLE;
    std::vector<VkDescriptorPool> descriptor_pools_;
    std::vector<Pass> passes_;
    bool in_pass_ = false;     // between begin_pass() and end_pass()
    bool timing_copy_ = false; // between begin_copy() and end_copy(), where those stamp
    uint64_t submitted_ = 0;
    int64_t submitted_ns_ = 0; // while a profile is recorded
};

} // namespace palpate
