#pragma once

#include <memory>
#include <optional>

#include "engine/render/ray_cast_pass.h"

namespace palpate {

// CoarseSettings::contrast where none is given.
double default_contrast(RayMode mode);

// A picture from fewer rays than it has pixels (CoarseSettings): every second pixel both ways,
// those that differ from their neighbours, and means between; or rays further apart, and what is
// linear between. Judges it by a few rays of full quality.
class CoarsePass {
 public:
    // For pictures of the scene's size.
    CoarsePass(RenderStore& store, const Scene& scene);
    ~CoarsePass() { store_->transfers.drop(table_); }
    CoarsePass(const CoarsePass&) = delete;
    CoarsePass& operator=(const CoarsePass&) = delete;
    bool suits(const Scene& scene) const;

    // How many times as long as the layer's its steps are.
    static double step_factor(const RayCastLayer& layer, const CoarseSettings& settings);

    // Over what lies behind all rays. `rays` is prepared, and the volume there.
    CoarseRays record(const ViewFrame& frame, RayCastPass& rays, const CoarseSettings& settings);

 private:
    using Rays = RayCastPass::Rays;
    void record_every_second(const ViewFrame& frame, RayCastPass& pass, const Rays& second,
                             uint32_t which, double contrast);
    void record_few(const ViewFrame& frame, RayCastPass& pass, const Rays& second,
                    const gpu::Frame& block, uint32_t which, uint32_t px_per_ray);
    void cast_sparse(const ViewFrame& frame, RayCastPass& pass, Rays rays);
    CoarseRays record_judgement(const ViewFrame& frame, RayCastPass& pass, const Rays& full);

    RenderStore* store_;
    glm::uvec2 size_px_; // of the picture
    uint32_t eyes_;
    GpuImage truth_, few_;               // of sparse rays; of rays more than two pixels apart
    Buffer spans_, tile_groups_, tiles_; // the latter of sparse rays
    Buffer ray_groups_, rays_listed_, first_hits_, squares_;
    std::shared_ptr<TransferImage> table_; // where the step differs
    uint32_t drawn_ = 1;                   // frames so far: the sparse rays wander
};

} // namespace palpate
