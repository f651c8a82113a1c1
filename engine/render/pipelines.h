#pragma once

#include <compare>
#include <span>

#include "engine/gpu/commands.h"

namespace palpate {

// What distinguishes one compiled ray caster from another.
struct RayCastVariant {
    uint32_t mode = 0; // gpu::kMode...
    bool preintegrated = false, exact = false, shaded = false;
    bool labels = false, slices = false, values = false, no_data = false;
    uint32_t iso_count = 1;
    bool skip = true;     // jump over empty space
    bool count = false;   // count samples
    uint32_t rays = 0;    // gpu::kRays...
    bool atlas = false;   // the volume lies in a brick atlas
    bool by_hand = false; // interpolate in fp32
    bool stored_gradients = false;
    uint32_t layers = 0; // see-through triangles in a ray's way, at most; slices is true then

    bool has_first_hits() const; // leaves and reads them: shaders/lib/first_hits.glsl
    friend auto operator<=>(const RayCastVariant&, const RayCastVariant&) = default;
};

// The passes over meshes, and what distinguishes their variants; see shaders/surface_*.comp.
enum class SurfaceStage { begin, draw, draw_large, caps, shade, compose };
struct SurfaceVariant {
    bool through = false, clips = false, layers = false, values = false;
    bool int64 = false; // draw: whole keys at a time
};

// The pipelines of the passes, by what distinguishes them; made when a scene first needs them.
class Pipelines {
 public:
    explicit Pipelines(GpuDevice& device) : cache_(device) {}

    ComputePipeline& ray_cast(const RayCastVariant& variant);
    ComputePipeline& slices(bool labels, bool atlas, bool by_hand);
    ComputePipeline& tiles(uint32_t which, bool spans); // gpu::kList...; see kTileSpans
    ComputePipeline& mip_slabs();
    ComputePipeline& interpolate();
    ComputePipeline& enlarge();
    ComputePipeline& judge();
    // What a stage does not distinguish is not looked at.
    ComputePipeline& surface(SurfaceStage stage, SurfaceVariant variant,
                             std::span<const Bound> bound);

    double creation_ms() const { return cache_.creation_ms(); }
    double wait_ms() const { return cache_.wait_ms(); }

 private:
    PipelineCache cache_;
};

} // namespace palpate
