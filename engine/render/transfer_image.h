#pragma once

#include <optional>

#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/scene/transfer_function.h"

namespace palpate {

// A transfer function on the GPU: rows of kTableEntries texels, see shaders/shared/ray_cast.h.
class TransferImage {
 public:
    TransferImage(GpuDevice& device, std::string name);

    bool is_for(const TransferFunction& function, double step_mm) const {
        return function_ == function && step_mm_ == step_mm;
    }
    // Makes the image that of `function` for steps of step_mm, if it is not that already.
    void hold(const TransferFunction& function, double step_mm, Commands& commands);

    GpuImage& image() { return image_; }
    double low() const { return low_; }
    double high() const { return high_; }
    glm::vec4 first() const { return first_; } // (rgb, tau per mm) of the entries at the ends
    glm::vec4 last() const { return last_; }

 private:
    std::optional<TransferFunction> function_;
    double step_mm_ = 0, low_ = 0, high_ = 0;
    glm::vec4 first_{}, last_{};
    GpuImage image_;
};

} // namespace palpate
