#pragma once

#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/scene/transfer_function.h"

namespace palpate {

// A transfer function on the GPU: rows of kTableEntries texels, see shaders/shared/ray_cast.h.
class TransferImage {
 public:
    TransferImage(Device& device, std::string name, const TransferFunction& function,
                  double step_mm);

    GpuImage& image() { return image_; }
    const TransferFunction& function() const { return function_; }
    double step_mm() const { return step_mm_; }
    double low() const { return low_; }
    double high() const { return high_; }

 private:
    TransferFunction function_;
    double step_mm_, low_, high_;
    GpuImage image_;
};

} // namespace palpate
