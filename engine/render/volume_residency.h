#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/offer.h"
#include "engine/render/cell_map.h"
#include "engine/render/change_log.h"
#include "engine/render/frame.h"
#include "engine/render/gpu_volume.h"
#include "engine/render/gradient_image.h"
#include "engine/render/needed_bricks.h"
#include "engine/render/render_options.h"
#include "engine/render/shared_pool.h"

namespace palpate {

class VolumeUse;

// A volume on the device, as one image or as an atlas, with its labels and what is made of its
// voxels: once for all views that draw it. Each view has a VolumeUse.
//
// An atlas holds what all views need while it has room for that; the bricks of one view then stay
// while another is drawn. Where it has not, it holds what the view being drawn needs, or a part of
// that at a time.
class VolumeResidency {
 public:
    VolumeResidency(GpuDevice& device, const RendererOptions& options)
        : device_(&device), options_(&options) {}

    // The needs of a view's frame beside its scene.
    struct Wish {
        double step_factor = 1.0;   // steps up to so many times as long as the layer's
        uint64_t kept_bytes = 0;    // for what the view is going to make
        uint64_t carried_bytes = 0; // the same, in case of an atlas
    };

    // Brings volume and labels in line with `data`, and all that is made of them in line with
    // `scene`, by copies recorded into `commands`. A volume of another size or type replaces the
    // one before; only if both do not fit the limit does the call wait until that one is gone.
    // Returns the number of uploaded bricks. Fails with a sentence if the volume does not fit.
    Result<size_t> prepare(VolumeUse& use, const Scene& scene, const SceneData& data,
                           const Wish& wish, Commands& commands);

    bool has_volume() const { return volume_.has_value(); }

    // For all views: nothing on the device is relied upon any more.
    void forget();

 private:
    friend class VolumeUse;
    uint64_t free_bytes(std::optional<GpuVolume>* apart);
    uint64_t room_for_volume(const Scene& scene, const Wish& wish);
    void make_room(uint64_t bytes, Commands& commands);
    std::vector<ChangedBrick> take_snapshot(const Volume& next);
    Result<size_t> keep(std::optional<GpuVolume>& held, const char* name, const Volume& volume,
                        GpuVolumeWish wish, std::span<const ChangedBrick> changed,
                        Commands& commands);
    void show_cells(VolumeUse& use, const RayCastLayer& layer, float value_scale, float value_bias,
                    Commands& commands);
    bool find_needed(VolumeUse& use, const Scene& scene, const Wish& wish); // whether for an atlas
    void count(const NeededBricks& needed, std::span<const glm::uvec3> turned);
    void release(VolumeUse& use);
    size_t show_needed(VolumeUse& use, Commands& commands);
    void keep_gradients(VolumeUse& use, const Scene& scene, double step_factor, Commands& commands);
    void leave(VolumeUse& use);
    void drop_unused();

    GpuDevice* device_;
    const RendererOptions* options_;
    std::vector<VolumeUse*> uses_;
    std::optional<Volume> snapshot_; // that log and cells know
    ChangeLog log_;
    std::optional<GpuVolume> volume_, labels_, fused_, overlay_;
    std::optional<GradientImage> gradients_;
    std::shared_ptr<VolumeCells> cells_;
    struct Cells {
        CellMap map;
        uint64_t read; // place in the log
    };
    SharedPool<Cells> cell_maps_;
    // Which bricks of an atlas views need:
    std::vector<uint16_t> needed_by_; // how many views, x fastest
    size_t needed_ = 0;               // bricks that any does
    std::vector<glm::uvec3> turned_;  // that came to be among these, or no longer are
    bool all_fit_ = false;            // the atlas holds them all
};

// One view's use of a VolumeResidency: what its last frame needs, and how that is reached.
class VolumeUse {
 public:
    explicit VolumeUse(VolumeResidency& residency);
    ~VolumeUse();
    VolumeUse(const VolumeUse&) = delete;
    VolumeUse& operator=(const VolumeUse&) = delete;

    // The view shows no voxels any more.
    void leave() { residency_->leave(*this); }

    bool shows_voxels() const { return shows_voxels_; }

    // After VolumeResidency::prepare():
    GpuVolume& volume() { return *residency_->volume_; }
    // Null where the frame shows none; the latter two where slices do.
    GpuImage* labels() { return has_labels_ ? &residency_->labels_->image() : nullptr; }
    GpuVolume* fused() { return has_fused_ ? &*residency_->fused_ : nullptr; }
    GpuImage* overlay() { return has_overlay_ ? &residency_->overlay_->image() : nullptr; }
    CellMap& cells() { return cells_->map; }
    // Stored gradients; null where the frame's rays take none.
    GpuImage* gradients() { return wants_gradients_ ? &residency_->gradients_->image() : nullptr; }

    // For an atlas: cuts what its rays need into parts that fit. Fails where not even slices or one
    // brick with its neighbours do, and for a MIP `among_layers` that needs several parts.
    Result<void> plan(const Scene& scene, std::span<const View> views, double step_factor,
                      bool among_layers);
    // The volume is marched in so many parts: 1, but in an atlas without room for all.
    size_t part_count() const { return std::max<size_t>(1, parts_.size()); }
    // Brings the bricks of a part, or those of the slices, into an atlas, for passes recorded from
    // here on. Returns how many were uploaded.
    size_t show_part(size_t part, Commands& commands);
    size_t show_slices(const Scene& scene, Commands& commands);
    void offer_atlas(Offer& offer, uint32_t pages, uint32_t frame, const Sampler& nearest);

    void tell(FrameStats& stats) const;

 private:
    friend class VolumeResidency;
    size_t show(const Part& part, bool first, Commands& commands);
    void forget();

    VolumeResidency* residency_;
    bool shows_voxels_ = false, has_labels_ = false, wants_gradients_ = false;
    bool has_fused_ = false, has_overlay_ = false;
    std::shared_ptr<VolumeResidency::Cells> cells_;
    std::optional<NeededBricks> needed_; // for an atlas, and for stored gradients
    uint64_t read_ = 0;                  // place in the log that they are for
    std::optional<std::pair<RayCastLayer, double>> gradients_filled_for_; // and step factor
    double cell_map_ms_ = 0, gradients_ms_ = 0;
    // In an atlas:
    size_t atlas_bricks_ = 0; // needed
    bool all_there_ = false;  // all that the view needs
    std::vector<Part> parts_;
    std::optional<BufferSlice> atlas_frame_;
};

} // namespace palpate
