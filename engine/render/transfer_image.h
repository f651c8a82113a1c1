#pragma once

#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/scene/transfer_function.h"

namespace palpate {

// A transfer function on the GPU: rows of kTableEntries texels, see shaders/shared/ray_cast.h.
class TransferImage {
 public:
    TransferImage(GpuDevice& device, std::string name, const TransferFunction& function,
                  double step_mm);

    GpuImage& image() { return image_; }
    const TransferFunction& function() const { return function_; }
    double step_mm() const { return step_mm_; }
    double low() const { return low_; }
    double high() const { return high_; }
    glm::vec4 first() const { return first_; } // (rgb, tau per mm) of the entries at the ends
    glm::vec4 last() const { return last_; }

 private:
    TransferFunction function_;
    double step_mm_, low_, high_;
    glm::vec4 first_, last_;
    GpuImage image_;
};

} // namespace palpate
