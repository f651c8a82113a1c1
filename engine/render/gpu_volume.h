#pragma once

#include "engine/base/error.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/volume/changes.h"

namespace palpate {

// How voxels are stored on the GPU.
enum class TexelFormat {
    automatic, // f32 on CPU devices (the fastest there); else unorm16, and f32 for float volumes
    unorm16,   // 16 bits with a bias: exact for every integer type; not for float volumes
    f32,
    label, // u8 or u16 identifiers, never filtered
};

// One volume as one 3D image, kept up to date brick by brick.
//
// There is no flat copy of the voxels on the CPU: bricks are converted straight into a staging ring
// of a few megabytes. value = texel * value_scale + value_bias.
class GpuVolume {
 public:
    // Uploads every brick. Fails with a sentence when the volume is larger than the device's images
    // or than what is left of memory_limit_bytes; nothing is down-sampled.
    static Result<GpuVolume> make(Device& device, std::string name, const Volume& volume,
                                  TexelFormat format, uint64_t memory_limit_bytes);

    // Uploads the bricks in which `next` differs from the snapshot held now (changed_bricks() tells
    // them), and holds `next`. Size and type must be those of the first snapshot.
    void update(const Volume& next, std::span<const ChangedBrick> changed);

    // Whether update() can take this volume.
    bool suits(const Volume& next, TexelFormat format) const;

    GpuImage& image() { return image_; }
    const Volume& snapshot() const { return snapshot_; }
    float value_scale() const { return value_scale_; }
    float value_bias() const { return value_bias_; }

 private:
    GpuVolume(Device& device, std::string name, const Volume& volume, TexelFormat requested,
              VkFormat format, float scale, float bias);
    void upload(const Volume& from, std::span<const glm::uvec3> bricks);

    Device* device_;
    Volume snapshot_;
    TexelFormat requested_;
    float value_scale_, value_bias_;
    GpuImage image_;
};

} // namespace palpate
