#pragma once

#include <vulkan/vulkan_core.h>

#include <cstddef>
#include <glm/glm.hpp>

#include "engine/gpu/device.h"
#include "engine/volume/volume.h"

namespace palpate {

// How voxels are stored on the GPU.
enum class TexelFormat {
    automatic, // f32 on CPU devices (the fastest there), where it fits; else unorm16, and f32 for
               // float volumes
    unorm16,   // 16 bits with a bias: exact for every integer type; not for float volumes
    f32,
    label, // u8 or u16 identifiers, never filtered
};

// A format and what its texels mean: value = texel * scale + bias.
struct TexelStorage {
    VkFormat format = VK_FORMAT_R32_SFLOAT;
    float scale = 1.0f, bias = 0.0f;
};
TexelStorage texel_storage(const GpuDevice& device, ScalarType type, TexelFormat wanted);

size_t texel_bytes(VkFormat format);

// Writes the box of samples [low, high) of a brick (in its own samples) as texels, rows of
// row_texels and planes of plane_rows; `out` is the place of the box's first sample.
void store_texels(const Brick& brick, VkFormat format, glm::uvec3 low, glm::uvec3 high,
                  size_t row_texels, size_t plane_rows, std::byte* out);

// The texel that stands for a value of the volume.
inline float texel_of(const TexelStorage& storage, float value) {
    return (value - storage.bias) / storage.scale;
}

} // namespace palpate
