#pragma once

#include <vulkan/vulkan_core.h>

#include <optional>

namespace palpate {

// How the next command will use a resource.
enum class Use {
    none,          // contents are not needed yet
    sampled,       // read by a compute shader through a sampler
    uniform,       // read by a compute shader as a uniform block
    storage_read,  // read by a compute shader as storage
    storage_write, // written (and maybe read) by a compute shader as storage
    indirect,      // read as the group counts of a dispatch
    copy_source,
    copy_target,
    clear_target,     // filled by a command
    color_attachment, // drawn to by a graphics pipeline
    present,          // shown by a window; after that a semaphore is waited for
    host_read,        // by the CPU after the submission is over
};

struct Access {
    VkPipelineStageFlags2 stages = VK_PIPELINE_STAGE_2_NONE;
    VkAccessFlags2 access = VK_ACCESS_2_NONE;
    VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
    bool writes = false;
};

// The pipeline stages, accesses and image layout of a use.
Access access_of(Use use);

// A barrier between two uses of a resource: the last one and the next.
struct Dependency {
    Access before, after;
};

// Remembers how one resource was used last.
class UseTracker {
 public:
    // The dependency that `next` needs, or nothing: two reads in one layout need none.
    std::optional<Dependency> advance(Use next);
    // Drops the contents, and the record of the last use, which something else made: a window's new
    // image. The next use begins after the semaphore that the submission waits for.
    void forget();

 private:
    Access last_{}; // merged over reads that follow one another
};

} // namespace palpate
