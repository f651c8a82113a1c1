// One view's use of the volume on the device.

#include <algorithm>

#include "engine/render/targets.h"
#include "engine/render/volume_parts.h"
#include "engine/render/volume_residency.h"

namespace palpate {

VolumeUse::VolumeUse(VolumeResidency& residency) : residency_(&residency) {
    residency.uses_.push_back(this);
}

VolumeUse::~VolumeUse() {
    leave();
    std::erase(residency_->uses_, this);
}

void VolumeUse::forget() {
    cells_.reset();
    needed_.reset();
    gradients_filled_for_.reset();
    parts_.clear();
    all_there_ = false;
}

Result<void> VolumeUse::plan(const Scene& scene, std::span<const View> views, double step_factor,
                             bool among_layers) {
    if (!shows_voxels_ || !volume().is_atlas())
        return {};
    const size_t room = volume().atlas().capacity();
    if (needed_->sliced_count() > room)
        return fail("the volume: its slices run through {} bricks, and the device has room for {}",
                    needed_->sliced_count(), room);
    if (!scene.ray_cast)
        return {};
    const Volume& held = volume().snapshot();
    if (all_there_) {
        parts_ = {{glm::uvec3(0), held.brick_count(), all_eyes(scene), {}}};
        return {};
    }
    std::vector<Viewpoint> viewpoints;
    for (const View& view : views)
        viewpoints.push_back(viewpoint_of(view, held.grid()));
    PALPATE_TRY(std::vector<Part> parts,
                plan_parts(held.brick_count(), needed_->seen(), room,
                           reach_samples(*scene.ray_cast, held.grid(), step_factor), viewpoints));
    if (parts.size() > 1 && scene.ray_cast->mode == RayMode::mip && among_layers)
        return fail(
            "the volume: a MIP behind see-through surfaces needs all of it on the device, "
            "which has room for {} of the {} bricks that can be seen",
            room, needed_->seen_count());
    parts_ = std::move(parts);
    return {};
}

size_t VolumeUse::show_part(size_t part, Commands& commands) {
    return volume().is_atlas() ? show(parts_[part], part == 0, commands) : 0;
}

size_t VolumeUse::show_slices(const Scene& scene, Commands& commands) {
    if (!volume().is_atlas())
        return 0;
    Part part{glm::uvec3(0), volume().snapshot().brick_count(), all_eyes(scene), {}};
    if (!all_there_)
        part.bricks = needed_->sliced();
    return show(part, true, commands);
}

size_t VolumeUse::show(const Part& part, bool first, Commands& commands) {
    BrickAtlas& atlas = volume().atlas();
    size_t uploaded = 0;
    if (!all_there_) {
        atlas.want_only(part.bricks);
        uploaded = atlas.upload_wanted(volume().snapshot(), commands);
    }
    atlas_frame_ =
        commands.upload(bytes_of(make_atlas_frame(atlas, volume().snapshot(), part, first)));
    return uploaded;
}

void VolumeUse::offer_atlas(Offer& offer, uint32_t pages, uint32_t frame, const Sampler& nearest) {
    if (volume().is_atlas())
        offer.sampled(pages, &volume().atlas().table(), nearest).uniform(frame, atlas_frame_);
}

void VolumeUse::tell(FrameStats& stats) const {
    if (!shows_voxels_) {
        stats.residency_reason = "nothing in the scene shows voxels";
        return;
    }
    GpuVolume& volume = *residency_->volume_;
    stats.cell_map_ms = cell_map_ms_;
    stats.gradients_ms = gradients_ms_;
    stats.atlas = volume.is_atlas();
    stats.residency_reason = volume.reason();
    stats.needed_bricks = atlas_bricks_;
    if (stats.atlas) {
        stats.room_for_bricks = volume.atlas().capacity();
        stats.parts = part_count();
    }
}

} // namespace palpate
