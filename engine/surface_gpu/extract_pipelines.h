#pragma once

#include "engine/gpu/commands.h"
#include "engine/surface/marching_cubes.h"

namespace palpate {

// Shared by all surfaces that are extracted on one device: the compiled passes (shaders/extract_*)
// and the triangles of the 256 cases. Declared after the device and before its surfaces. Passes are
// made when they are first asked for, and the driver may compile at the first dispatch: most of a
// second on a CPU device, once.
class ExtractPipelines {
 public:
    explicit ExtractPipelines(GpuDevice& device);

    GpuDevice& device() { return *device_; }

    ComputePipeline& cull(bool list);
    ComputePipeline& scan();
    ComputePipeline& count();
    ComputePipeline& emit(bool normals);

    Buffer& cases() { return cases_; } // gpu::ExtractCase[256]
    const Sampler& nearest() const { return nearest_; }

 private:
    GpuDevice* device_;
    PipelineCache pipelines_;
    Buffer cases_;
    Sampler nearest_;
};

} // namespace palpate
