#pragma once

#include <optional>
#include <vector>

#include "engine/gpu/commands.h"

namespace palpate {

// The resources that a pass has for a shader, named by the constants that GLSL and C++ share. Each
// dispatch takes those that its variant declares: the build read them from the SPIR-V, so C++ does
// not repeat the conditions (#if) of the shader. Null: the pass has none; a dispatch whose variant
// declares it fails and names it.
class Offer {
 public:
    Offer& uniform(uint32_t binding, const std::optional<BufferSlice>& slice) {
        return slice ? add(bind_uniform(binding, *slice)) : *this;
    }
    Offer& storage(uint32_t binding, Buffer* buffer, Use use = Use::storage_read) {
        return buffer ? add(bind_storage(binding, *buffer, use)) : *this;
    }
    Offer& sampled(uint32_t binding, GpuImage* image, const Sampler& sampler) {
        return image ? add(bind_sampled(binding, *image, sampler)) : *this;
    }
    Offer& storage_image(uint32_t binding, GpuImage* image) {
        return image ? add(bind_storage_image(binding, *image)) : *this;
    }

    // For Commands::dispatch(), in the order in which they were offered.
    std::vector<Bound> taken_by(const ComputePipeline& pipeline) const;

 private:
    Offer& add(const Bound& bound) {
        offered_.push_back(bound);
        return *this;
    }

    std::vector<Bound> offered_;
};

// Null where there is none.
template <class T>
T* pointer_to(std::optional<T>& value) {
    return value ? &*value : nullptr;
}

} // namespace palpate
