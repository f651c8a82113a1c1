#pragma once

#include <vulkan/vulkan_core.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

// Compute shaders as native code of this processor. The build translates the SPIR-V of every shader
// to C++ (cmake/native) and registers a kernel for it; engine/native's driver runs kernels as a
// Vulkan device. Nothing here calls Vulkan.
namespace palpate::native {

// Memory behind a storage or uniform buffer, from its offset on. Reads that begin or end beyond
// `bytes` give 0, writes are dropped, and atomics there give 0.
struct Buffer {
    std::byte* data = nullptr; // aligned to 16 bytes
    uint64_t bytes = 0;
};

// The texels of an image as its view shows them: x fastest, at
// texels + x * texel size + y * row_bytes + z * slice_bytes, where z counts slices or layers.
// Reads outside give 0 in all channels (1 in a missing alpha), writes are dropped.
// 64 bytes before and behind the texels must be readable.
struct Image {
    std::byte* texels = nullptr;
    VkFormat format = VK_FORMAT_UNDEFINED; // of those that texel_bytes() knows
    uint32_t width = 1, height = 1;
    uint32_t depth = 1; // slices, or layers of an array
    int64_t row_bytes = 0, slice_bytes = 0;
    bool is_array = false; // z counts layers, which are never blended; of one dimension, too
};

struct Sampler {
    bool is_linear = false;
    bool is_normalised = true; // coordinates run from 0 to 1 across the image
    // Coordinates beyond the image take the nearest texel, or the border: zeros.
    bool is_clamped_to_border = false;
};

// One binding of a kernel is bound to this; the members that its kind does not need are unused. A
// binding that the launch does not reach may stay empty.
struct Resource {
    Buffer buffer;
    Image image;
    Sampler sampler;
};

struct Binding {
    uint32_t set, binding;
    VkDescriptorType type; // storage or uniform buffer, storage image, image with its sampler
    bool is_used = true;   // else the module has no such binding, and the kernel leaves it alone
};

struct Constant {
    uint32_t id;
    uint32_t bits; // unless the pipeline says otherwise
};

// One dispatch.
struct Launch {
    std::span<const Resource> resources; // of Kernel::bindings, in their order
    std::span<const uint32_t> constants; // of Kernel::constants, in their order
    std::span<const std::byte> push_constants;
    std::array<uint32_t, 3> first_group{}; // of vkCmdDispatchBase
    std::array<uint32_t, 3> groups{};
};

// One module of SPIR-V as native code, for one width.
struct Kernel {
    uint64_t hash; // hash_of() the words that vkCreateShaderModule is given
    const char* name;
    std::array<uint32_t, 3> group_size;
    std::span<const Binding> bindings;
    std::span<const Constant> constants;
    // Runs the groups first .. first + count - 1 of groups[0] * groups[1] * groups[2], x fastest.
    // Threads may run parts of one launch at once; where they meet, memory is changed by atomics.
    void (*run)(const Launch& launch, uint64_t first, uint64_t count);
};

// FNV-1a of the words.
constexpr uint64_t hash_of(std::span<const uint32_t> words) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (const uint32_t word : words)
        hash = (hash ^ word) * 0x100000001b3u;
    return hash;
}

// Formats that kernels read and write: R8, R16, R32 and their pairs and quadruples, as far as
// listed in the source; 0 for all others.
uint32_t texel_bytes(VkFormat format);

// Lanes that a kernel of this processor computes at a time: 16 with AVX-512, else 8.
uint32_t width();
// "AVX-512", "AVX2" or "SSE2".
const char* instructions();

// The kernel of a module for width() on this processor; null where the build has none.
const Kernel* find_kernel(uint64_t hash);
// All of them, by hash.
std::span<const Kernel* const> kernels();

// Instruction sets, each built from the same C++.
enum class Level : size_t { kSse2, kAvx2, kAvx512 };

// Adds kernels before main() runs: the source that embeds a shader's words has one of these, so
// that a program holds the kernels of the shaders that it holds.
struct Registered {
    Registered(Level level, std::initializer_list<const Kernel*> kernels);
};

} // namespace palpate::native
