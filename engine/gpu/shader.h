#pragma once

#include <vulkan/vulkan_core.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace palpate {

// A binding of a compute shader, in set 0.
struct BindingSlot {
    uint32_t binding;
    VkDescriptorType type;
    uint64_t least_bytes; // of a buffer: all but an array of open length at its end; else 0
    const char* name;     // in the shader
};

// A specialization constant. All are 32 bits wide.
struct ShaderConstant {
    uint32_t id;
    const char* name;
    uint32_t bits; // what the shader itself says
};
constexpr size_t kMaxShaderConstants = 16;

// One variant of a compute shader, a combination of its macros, as cmake/embed_spirv.cpp read it
// from the SPIR-V. Lives as long as the program.
struct ShaderCode {
    const char* name; // the shader's, and the macros that are 1: "slices has_labels"
    std::span<const uint32_t> words;
    std::span<const BindingSlot> slots; // by rising binding
    std::span<const ShaderConstant> constants;
};

// The recipe of a pipeline: a variant, and the values of its constants in their order. Never filled
// in by hand: from shaders/slices.comp the build makes spirv/slices.h, and
// spirv::Slices{.has_labels = true, .manual = 1} converts to it.
struct Shader {
    const ShaderCode* code;
    std::array<uint32_t, kMaxShaderConstants> constants{};

    // The code's, and the constants that differ from the shader's own: "slices has_labels
    // manual=1".
    std::string name() const;
    friend auto operator<=>(const Shader&, const Shader&) = default;
};

} // namespace palpate
