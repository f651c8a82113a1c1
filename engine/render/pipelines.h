#pragma once

#include <span>

#include "engine/gpu/commands.h"

namespace palpate {

// The passes over meshes, and what distinguishes their variants; see shaders/surface_*.comp.
enum class SurfaceStage { begin, draw, draw_large, caps, shade, compose };
struct SurfaceVariant {
    bool through = false, clips = false, layers = false, values = false;
    bool int64 = false; // draw: whole keys at a time
};

// The pipelines of the passes; made when a scene first needs them.
class Pipelines : public PipelineCache {
 public:
    using PipelineCache::PipelineCache;

    // What a stage does not distinguish is not looked at.
    ComputePipeline& surface(SurfaceStage stage, SurfaceVariant variant, std::span<const Bound>);
};

} // namespace palpate
