#pragma once

#include <vulkan/vulkan_core.h>

#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "engine/gpu/resource.h"

namespace palpate {

// The buffer or image that one dispatch gives to a binding of its shader.
struct Bound {
    uint32_t binding;
    Use use;
    std::variant<BufferSlice, GpuImage*> resource;
    const Sampler* sampler = nullptr;
};
inline Bound bind_uniform(uint32_t binding, BufferSlice slice) {
    return {binding, Use::uniform, slice};
}
inline Bound bind_storage(uint32_t binding, BufferSlice slice, Use use = Use::storage_read) {
    return {binding, use, slice};
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

// The record of one submission; lives as long as its Commands or a Ticket.
struct Recorded;

// The results of submitted commands: times and read-back bytes, known once the device is past the
// commands. Copies are equal and share the bytes. It must not outlive the device.
class Ticket {
 public:
    explicit Ticket(std::shared_ptr<Recorded> recorded) : recorded_(std::move(recorded)) {}

    // The value that the timeline reaches once all is done; 0 before submit().
    uint64_t value() const;
    bool ready() const; // never waits
    void wait() const;  // for what was submitted by submit(); for nothing before that
    // After submit(): waits where not ready(), and returns the time of each pass. While a profile
    // is recorded, the first call tells it of the passes, and of every copy as one more.
    std::vector<PassTime> times() const;

 private:
    std::shared_ptr<Recorded> recorded_;
};

// Records passes in a list, with the barriers their uses need, into slots that the device recycles:
// after a few frames, recording creates nothing. Used once.
//
// Barriers follow the order of recording, so commands are submitted in that order: what uses a
// resource is recorded after what used it before has been.
class Commands {
 public:
    explicit Commands(GpuDevice& device);
    ~Commands(); // drops what was not submitted; only for commands that wrote nothing to be used
    Commands(const Commands&) = delete;
    Commands& operator=(const Commands&) = delete;

    // Names what follows, in captures and in the times that finish() returns.
    void begin_pass(const std::string& name);
    void end_pass();

    void use(GpuImage& image, Use use);
    void use(Buffer& buffer, Use use);

    // `bound` holds one of each binding of the shader, in any order, and nothing else; a fault is
    // told with the binding's name in the shader. Uses are tracked here. Workgroup numbers start at
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
    void copy(BufferSlice from, GpuImage& to, std::span<const Region> regions);
    void copy(GpuImage& from, BufferSlice to, std::span<const Region> regions);
    void copy(GpuImage& from, GpuImage& to); // all of it; both have one shape
    struct Area {                            // texels
        glm::uvec2 low, size;
    };
    // Copies rectangles between 2D images of one layer, each to the same place; one or more.
    void copy(GpuImage& from, GpuImage& to, std::span<const Area> areas);
    void copy(BufferSlice from, BufferSlice to); // all of `from`; `to` is no smaller
    struct Bytes {
        uint64_t from, to, count; // the first byte in either
    };
    void copy(Buffer& from, Buffer& to, std::span<const Bytes> pieces); // one or more

    // Mapped memory for the CPU to write, which passes recorded from here on may read in place or
    // copy from. It is recycled: nothing may refer to it after these commands. bytes > 0.
    BufferSlice staging(uint64_t bytes);
    BufferSlice upload(std::span<const std::byte> bytes); // the same, filled

    // Brings bytes to a buffer, from its byte `first` on, or texels to an image: as a pass
    // "upload", through staging(), a few megabytes at a time. What is more than that is submitted
    // at once, so that the device copies while the CPU fills the next; this waits for all but the
    // newest of these submissions.
    void upload(std::span<const std::byte> bytes, Buffer& to, uint64_t first = 0);
    // Texels come in `pieces` of at most piece_bytes. fill(first, count, to) writes some of them to
    // `to`, which has room for them, and returns their regions: buffer_offset counts from the start
    // of `to`.
    using Fill =
        std::function<std::vector<Region>(size_t first, size_t count, std::span<std::byte> to)>;
    void upload(GpuImage& to, size_t pieces, uint64_t piece_bytes, const Fill& fill);

    // Mapped memory that gets all of a buffer, or regions of an image, `bytes` in all: to be read
    // once the work is done, for as long as these commands or a ticket of theirs live.
    BufferSlice read_back(Buffer& from);
    BufferSlice read_back(GpuImage& from, std::span<const Region> regions, uint64_t bytes);

    // The next submission of these commands waits for a semaphore, and their last one signals one:
    // as a window's picture needs it. A binary semaphore is waited for once.
    void wait_for(const SemaphoreUse& semaphore) { waits_.push_back(semaphore); }
    void signal(const SemaphoreUse& semaphore) { signals_.push_back(semaphore); }

    // Hands what was recorded so far to the device; recording goes on. Outside of passes.
    void flush() { submit_open({}); }
    // Hands the work over and returns at once; the timeline value to wait for.
    uint64_t submit();
    Ticket ticket() const { return Ticket(recorded_); }
    // Passes begun so far: what is recorded next has this place in Ticket::times().
    size_t pass_count() const { return pass_count_; }
    // ticket().times() after submit().
    std::vector<PassTime> finish();

 private:
    VkCommandBuffer handle();
    CommandSlot& slot();
    void submit_open(std::span<const SemaphoreUse> signals);
    void bind(const ComputePipeline& pipeline, std::span<const Bound> bound);
    void barrier(const VkDependencyInfo& info);
    void begin_stamp(std::string name);
    void end_stamp();
    void begin_copy(const char* name, uint64_t bytes);
    void end_copy();
    void in_batches(size_t pieces, uint64_t piece_bytes,
                    const std::function<void(size_t first, size_t count)>& record);

    GpuDevice* device_;
    std::shared_ptr<Recorded> recorded_;
    std::vector<SemaphoreUse> waits_, signals_;
    size_t pass_count_ = 0;
    bool in_pass_ = false;     // between begin_pass() and end_pass()
    bool timing_copy_ = false; // between begin_copy() and end_copy(), where those stamp
};

} // namespace palpate
