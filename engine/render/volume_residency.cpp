#include "engine/render/volume_residency.h"

#include <algorithm>

#include "engine/base/timer.h"

namespace palpate {

namespace {

bool is_same_kind(const Volume& a, const Volume& b) {
    return a.size() == b.size() && a.type() == b.type();
}

size_t index_of(glm::uvec3 brick, glm::uvec3 count) {
    return brick.x + count.x * (brick.y + size_t{count.y} * brick.z);
}

} // namespace

// The rest of the limit beside all that is on the device, `apart` excepted.
uint64_t VolumeResidency::free_bytes(std::optional<GpuVolume>* apart) {
    const uint64_t used = device_->resource_bytes() - (apart && *apart ? (*apart)->bytes() : 0);
    return options_->memory_limit_bytes - std::min(options_->memory_limit_bytes, used);
}

// The bytes that the volume may take: some are kept for resources that are made after it.
uint64_t VolumeResidency::room_for_volume(const Scene& scene, const Wish& wish) {
    uint64_t kept = wish.kept_bytes + (1 << 20); // tables, uniforms, lists of tiles
    if (scene.ray_cast)                          // macro-cells of a MIP with their staging
        kept += 8 * cells_->ranges().cells();
    const uint64_t free = free_bytes(&volume_);
    return free - std::min(free, kept);
}

// Waits for dropped resources to be gone, where there is no room beside them.
void VolumeResidency::make_room(uint64_t bytes, Commands& commands) {
    const uint64_t retired = device_->retired_bytes();
    if (retired == 0 || device_->resource_bytes() + retired + bytes <= options_->memory_limit_bytes)
        return;
    commands.flush();
    device_->wait(device_->last_submitted());
}

// The bricks in which `next` differs from the last snapshot. The log and the cells are told, too.
std::vector<ChangedBrick> VolumeResidency::take_snapshot(const Volume& next) {
    std::vector<ChangedBrick> changed;
    if (!snapshot_ || !is_same_kind(*snapshot_, next)) {
        for (VolumeUse* use : uses_)
            use->forget();
        cell_maps_.clear();
        cells_.reset();
        const glm::uvec3 count = next.brick_count();
        needed_by_.assign(size_t{count.x} * count.y * count.z, 0);
        needed_ = 0;
        turned_.clear();
        all_fit_ = false;
    } else if (!next.is_same_as(*snapshot_)) {
        changed = changed_bricks(*snapshot_, next);
        log_.add(changed);
        if (cells_)
            cells_->update(next, changed);
    }
    snapshot_ = next;
    return changed;
}

Result<size_t> VolumeResidency::keep(std::optional<GpuVolume>& held, const char* name,
                                     const Volume& volume, GpuVolumeWish wish,
                                     std::span<const ChangedBrick> changed, Commands& commands) {
    if (held && held->suits(volume, wish)) {
        if (volume.is_same_as(held->snapshot()))
            return size_t{0};
        held->update(volume, changed, commands);
        return held->is_atlas() ? 0 : changed.size();
    }
    if (held && held->is_atlas()) // one that edits fill is not made anew for each of them
        wish.needed_bricks += wish.needed_bricks / 4;
    held.reset();
    make_room(GpuVolume::bytes_for(*device_, volume, wish), commands);
    PALPATE_TRY(GpuVolume made, GpuVolume::make(*device_, name, volume, wish, commands));
    held.emplace(std::move(made));
    all_fit_ = false;
    const glm::uvec3 bricks = volume.brick_count();
    return held->is_atlas() ? 0 : size_t{bricks.x} * bricks.y * bricks.z;
}

Result<size_t> VolumeResidency::prepare(VolumeUse& use, const Scene& scene, const SceneData& data,
                                        const Wish& wish, Commands& commands) {
    use.shows_voxels_ = true;
    use.has_labels_ = data.labels.has_value();
    use.has_fused_ = data.fused && !scene.slices.empty();
    use.has_overlay_ = data.overlay && !scene.slices.empty();
    use.wants_gradients_ = options_->stored_gradients && scene.ray_cast &&
                           scene.ray_cast->mode == RayMode::alpha && scene.ray_cast->shading &&
                           options_->sampling == Sampling::device;
    if (!scene.ray_cast)
        cell_maps_.drop(use.cells_);
    drop_unused();
    const auto changed_since = [](const std::optional<GpuVolume>& held, const Volume& next) {
        return held && is_same_kind(held->snapshot(), next) && !next.is_same_as(held->snapshot())
                   ? changed_bricks(held->snapshot(), next)
                   : std::vector<ChangedBrick>{};
    };
    size_t uploaded = 0;
    const auto keep_beside = [&](std::optional<GpuVolume>& held, const char* name,
                                 const Volume& next, TexelFormat format) -> Result<void> {
        PALPATE_TRY(const size_t more, keep(held, name, next,
                                            {.format = format,
                                             .residency = Residency::dense,
                                             .limit_bytes = free_bytes(&held)},
                                            changed_since(held, next), commands));
        uploaded += more;
        return {};
    };
    if (use.has_labels_)
        PALPATE_TRY(keep_beside(labels_, "labels", *data.labels, TexelFormat::label));
    if (use.has_fused_)
        PALPATE_TRY(keep_beside(fused_, "fused volume", *data.fused, options_->volume_format));
    if (use.has_overlay_)
        PALPATE_TRY(keep_beside(overlay_, "overlay", *data.overlay, TexelFormat::label));
    const Timer timer;
    const bool in_step = volume_ && snapshot_ && volume_->snapshot().is_same_as(*snapshot_);
    std::vector<ChangedBrick> changed = take_snapshot(data.volume);
    if (!in_step)
        changed = changed_since(volume_, data.volume);
    if (scene.ray_cast && !cells_)
        cells_ = std::make_shared<VolumeCells>(data.volume);
    const bool maxima = scene.ray_cast && scene.ray_cast->mode == RayMode::mip;
    if (scene.ray_cast && !maxima) // which bricks are needed depends on distances
        show_cells(use, *scene.ray_cast, 1.0f, 0.0f, commands);
    use.cell_map_ms_ = scene.ray_cast ? timer.ms() : 0.0;

    const bool for_atlas = find_needed(use, scene, wish);
    PALPATE_TRY(const size_t more, keep(volume_, "volume", data.volume,
                                        {.format = options_->volume_format,
                                         .residency = options_->residency,
                                         .limit_bytes = room_for_volume(scene, wish),
                                         .beside_atlas_bytes = wish.carried_bytes,
                                         .needed_bricks = for_atlas ? needed_ : 0,
                                         .most_bricks = options_->most_resident_bricks},
                                        changed, commands));
    uploaded += more;
    if (maxima) { // and these on how the volume is stored
        const Timer again;
        show_cells(use, *scene.ray_cast, volume_->value_scale(), volume_->value_bias(), commands);
        use.cell_map_ms_ += again.ms();
    }
    use.parts_.clear();
    use.all_there_ = false;
    if (volume_->is_atlas())
        uploaded += show_needed(use, commands);
    turned_.clear();
    keep_gradients(use, scene, wish.step_factor, commands);
    return uploaded;
}

void VolumeResidency::show_cells(VolumeUse& use, const RayCastLayer& layer, float value_scale,
                                 float value_bias, Commands& commands) {
    cell_maps_.take(
        use.cells_,
        [&](const Cells& one) { return one.map.is_for(layer, value_scale, value_bias); },
        [&] {
            return std::make_shared<Cells>(Cells{CellMap(*device_, cells_), log_.end()});
        });
    use.cells_->map.show(layer, value_scale, value_bias, log_.since(use.cells_->read), commands);
    use.cells_->read = log_.end();
}

bool VolumeResidency::find_needed(VolumeUse& use, const Scene& scene, const Wish& wish) {
    const Volume& volume = *snapshot_;
    const glm::uvec3 size = volume.size();
    const bool is_there = volume_ && is_same_kind(volume_->snapshot(), volume);
    const bool fits = // whatever can be seen
        std::max({size.x, size.y, size.z}) <= device_->limits().maxImageDimension3D &&
        sample_count(volume.grid()) * sizeof(float) <= room_for_volume(scene, wish) / 2;
    const bool dense =
        options_->residency == Residency::dense ||
        (options_->residency == Residency::automatic && (is_there ? !volume_->is_atlas() : fits));
    use.atlas_bricks_ = 0;
    if (dense && !use.wants_gradients_) {
        release(use);
        return false;
    }
    if (!use.needed_) {
        use.needed_.emplace(volume);
        use.read_ = log_.end();
    }
    use.needed_->update(scene, volume, log_.since(use.read_),
                        use.cells_ ? &use.cells_->map : nullptr, wish.step_factor);
    use.read_ = log_.end();
    count(*use.needed_, use.needed_->take_turned());
    if (!dense)
        use.atlas_bricks_ = use.needed_->count();
    return !dense;
}

// Adds a view's needs up with those of the others; `turned` are those that changed.
void VolumeResidency::count(const NeededBricks& needed, std::span<const glm::uvec3> turned) {
    for (const glm::uvec3 brick : turned) {
        uint16_t& views = needed_by_[index_of(brick, snapshot_->brick_count())];
        const bool before = views > 0;
        views = static_cast<uint16_t>(needed.needs(brick) ? views + 1 : views - 1);
        if (before == (views > 0))
            continue;
        needed_ = before ? needed_ - 1 : needed_ + 1;
        turned_.push_back(brick);
    }
}

// The view needs no bricks any more.
void VolumeResidency::release(VolumeUse& use) {
    if (!use.needed_)
        return;
    for (const glm::uvec3 brick : use.needed_->all())
        if (--needed_by_[index_of(brick, snapshot_->brick_count())] == 0) {
            --needed_;
            turned_.push_back(brick);
        }
    use.needed_.reset();
}

// Brings what came to be needed into the atlas, where it has room for all that views need, or at
// least for what this one does.
size_t VolumeResidency::show_needed(VolumeUse& use, Commands& commands) {
    BrickAtlas& atlas = volume_->atlas();
    const bool in_step = all_fit_;
    all_fit_ = needed_ <= atlas.capacity();
    use.all_there_ = use.needed_->count() <= atlas.capacity();
    if (!use.all_there_)
        return 0;
    if (all_fit_ && in_step) {
        for (const glm::uvec3 brick : turned_)
            atlas.want(brick, needed_by_[index_of(brick, snapshot_->brick_count())] > 0);
    } else if (all_fit_) {
        std::vector<glm::uvec3> all;
        for_each_brick(*snapshot_, [&](glm::uvec3 brick) {
            if (needed_by_[index_of(brick, snapshot_->brick_count())] > 0)
                all.push_back(brick);
        });
        atlas.want_only(all);
    } else {
        atlas.want_only(use.needed_->all());
    }
    return atlas.upload_wanted(*snapshot_, commands);
}

// After the volume, for shaded alpha: fills what its rays may read.
void VolumeResidency::keep_gradients(VolumeUse& use, const Scene& scene, double step_factor,
                                     Commands& commands) {
    use.gradients_ms_ = 0;
    const Volume& volume = *snapshot_;
    if (volume_->is_atlas())
        use.wants_gradients_ = false;
    if (gradients_ && !is_same_kind(gradients_->snapshot(), volume))
        gradients_.reset();
    drop_unused();
    if (!use.wants_gradients_)
        return;
    const uint64_t bytes = GradientImage::bytes_for(volume);
    if (!gradients_ && bytes > free_bytes(nullptr)) {
        use.wants_gradients_ = false;
        return;
    }
    const bool filled_anew = !gradients_ || !volume.is_same_as(gradients_->snapshot());
    if (!gradients_) {
        make_room(bytes, commands);
        gradients_.emplace(*device_, volume);
    } else if (filled_anew) {
        gradients_->update(volume, changed_bricks(gradients_->snapshot(), volume));
    }
    for (VolumeUse* one : uses_)
        if (filled_anew)
            one->gradients_filled_for_.reset();
    const Timer timer;
    const std::pair filled_for(*scene.ray_cast, step_factor);
    if (use.gradients_filled_for_ == filled_for)
        return;
    gradients_->fill(use.needed_->seen(), commands);
    use.gradients_filled_for_ = filled_for;
    use.gradients_ms_ = timer.ms();
}

void VolumeResidency::leave(VolumeUse& use) {
    release(use);
    cell_maps_.drop(use.cells_);
    use.forget();
    use.shows_voxels_ = use.has_labels_ = use.wants_gradients_ = false;
    use.has_fused_ = use.has_overlay_ = false;
    drop_unused();
}

// Drops resources that no view uses any more.
void VolumeResidency::drop_unused() {
    const auto any = [&](bool VolumeUse::*flag) {
        return std::any_of(uses_.begin(), uses_.end(),
                           [&](const VolumeUse* use) { return use->*flag; });
    };
    if (!any(&VolumeUse::has_labels_))
        labels_.reset();
    if (!any(&VolumeUse::has_fused_))
        fused_.reset();
    if (!any(&VolumeUse::has_overlay_))
        overlay_.reset();
    if (!any(&VolumeUse::wants_gradients_))
        gradients_.reset();
    if (cell_maps_.empty())
        cells_.reset();
    if (!any(&VolumeUse::shows_voxels_))
        forget();
}

void VolumeResidency::forget() {
    for (VolumeUse* use : uses_)
        use->forget();
    snapshot_.reset();
    log_ = {};
    volume_.reset();
    labels_.reset();
    fused_.reset();
    overlay_.reset();
    gradients_.reset();
    cell_maps_.clear();
    cells_.reset();
}

} // namespace palpate
