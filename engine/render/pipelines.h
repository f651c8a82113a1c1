#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

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

// Makes each pipeline when a scene first needs it, once per process, on a thread of its own: what
// is asked for before work of other kinds is ready after it.
class Pipelines {
 public:
    explicit Pipelines(GpuDevice& device) : device_(&device) {}

    ComputePipeline& ray_cast(const RayCastVariant& variant);
    ComputePipeline& slices(bool labels, bool atlas, bool by_hand);
    ComputePipeline& tiles(uint32_t which, bool spans); // gpu::kList...; see kTileSpans
    ComputePipeline& mip_slabs();
    ComputePipeline& interpolate();
    ComputePipeline& enlarge();
    ComputePipeline& judge();
    // With bindings as `bound` has them; what a stage does not distinguish is not looked at.
    ComputePipeline& surface(SurfaceStage stage, SurfaceVariant variant,
                             std::span<const Bound> bound);

    double creation_ms() const; // spent so far, on threads beside each other
    double wait_ms() const;     // of that, what was waited for

 private:
    template <class... Arguments>
    ComputePipeline& made(std::unique_ptr<ComputePipeline>& pipeline, Arguments&&... arguments);

    GpuDevice* device_;
    std::vector<const ComputePipeline*> all_;
    std::map<RayCastVariant, std::unique_ptr<ComputePipeline>> ray_casts_;
    std::map<uint32_t, std::unique_ptr<ComputePipeline>> slices_;
    std::map<std::pair<uint32_t, bool>, std::unique_ptr<ComputePipeline>> tiles_;
    std::map<const uint32_t*, std::unique_ptr<ComputePipeline>> surfaces_; // by their code
    std::unique_ptr<ComputePipeline> mip_slabs_, interpolate_, enlarge_, judge_;
};

} // namespace palpate
