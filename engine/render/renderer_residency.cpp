// How the volume lies on the device: as one image, or as the bricks of an atlas that a scene needs.

#include <algorithm>

#include "engine/base/timer.h"
#include "engine/render/held.h"
#include "engine/render/volume_parts.h"
#include "engine/volume/changes.h"
#include "shaders/shared/ray_cast.h"

namespace palpate {

namespace {

ImageShape carry_shape(const Scene& scene) {
    return {.format = VK_FORMAT_R32G32B32A32_SFLOAT,
            .size = {scene.size_px, 1},
            .layers = eye_count(scene) * gpu::kCarryLayers,
            .storage = true};
}

uint64_t carry_bytes(const Scene& scene) {
    const ImageShape shape = carry_shape(scene);
    return sizeof(glm::vec4) * shape.size.x * uint64_t{shape.size.y} * shape.layers;
}

} // namespace

Result<size_t> Renderer::keep_volume(std::optional<GpuVolume>& held, const char* name,
                                     const Volume& volume, GpuVolumeWish wish,
                                     std::span<const ChangedBrick> changed, Commands& commands) {
    if (held && held->suits(volume, wish)) {
        if (volume.is_same_as(held->snapshot()))
            return size_t{0};
        held->update(volume, changed, commands);
        return held->is_atlas() ? 0 : changed.size();
    }
    if (held)
        finish(commands);
    if (held && held->is_atlas()) // one that edits fill is not made anew for each of them
        wish.needed_bricks += wish.needed_bricks / 4;
    held.reset();
    Result<GpuVolume> made = GpuVolume::make(*device_, name, volume, wish, commands);
    if (!made)
        return pass_on(made);
    held.emplace(std::move(*made));
    held_->all_fit = false;
    const glm::uvec3 bricks = volume.brick_count();
    return held->is_atlas() ? 0 : size_t{bricks.x} * bricks.y * bricks.z;
}

// What is left of the limit beside all that is on the device, `apart` excepted.
uint64_t Renderer::free_bytes(std::optional<GpuVolume>& apart) const {
    uint64_t used = device_->resource_bytes();
    if (apart)
        used -= apart->bytes();
    return options_.memory_limit_bytes - std::min(options_.memory_limit_bytes, used);
}

Result<size_t> Renderer::keep_volumes(const Scene& scene, const SceneData& data,
                                      Commands& commands) {
    const auto same_kind = [](const std::optional<GpuVolume>& held, const Volume& next) {
        return held && held->snapshot().size() == next.size() &&
               held->snapshot().type() == next.type();
    };
    const auto changed_since = [&](const std::optional<GpuVolume>& held, const Volume& next) {
        return same_kind(held, next) && !next.is_same_as(held->snapshot())
                   ? changed_bricks(held->snapshot(), next)
                   : std::vector<ChangedBrick>{};
    };
    const std::vector<ChangedBrick> changed = changed_since(held_->volume, data.volume);
    const std::vector<ChangedBrick> changed_labels =
        data.labels ? changed_since(held_->labels, *data.labels) : std::vector<ChangedBrick>{};
    size_t uploaded = 0;
    if (data.labels) {
        const Result<size_t> more =
            keep_volume(held_->labels, "labels", *data.labels,
                        {.format = TexelFormat::label, .limit_bytes = free_bytes(held_->labels)},
                        changed_labels, commands);
        if (!more)
            return more;
        uploaded = *more;
    } else {
        held_->labels.reset();
    }
    const Timer timer;
    if (!same_kind(held_->volume, data.volume))
        held_->needed.reset();
    if (!scene.ray_cast || !same_kind(held_->volume, data.volume))
        held_->cells.reset();
    else if (held_->cells && !data.volume.is_same_as(held_->volume->snapshot()))
        held_->cells->update(data.volume, changed);
    if (scene.ray_cast && !held_->cells)
        held_->cells.emplace(*device_, data.volume);
    const bool maxima = scene.ray_cast && scene.ray_cast->mode == RayMode::mip;
    if (scene.ray_cast && !maxima) // which bricks are needed depends on distances
        held_->cells->show(*scene.ray_cast, 1.0f, 0.0f, commands);
    held_->cell_map_ms = timer.ms();

    find_needed_bricks(scene, data.volume, changed);
    const uint64_t carried = scene.ray_cast && !held_->targets->carry ? carry_bytes(scene) : 0;
    const Result<size_t> more = keep_volume(held_->volume, "volume", data.volume,
                                            {.format = options_.volume_format,
                                             .residency = options_.residency,
                                             .limit_bytes = room_for_volume(scene),
                                             .beside_atlas_bytes = carried,
                                             .needed_bricks = held_->needed_bricks,
                                             .most_bricks = options_.most_resident_bricks},
                                            changed, commands);
    if (!more)
        return more;
    if (maxima) { // and these on how the volume is stored
        const Timer again;
        held_->cells->show(*scene.ray_cast, held_->volume->value_scale(),
                           held_->volume->value_bias(), commands);
        held_->cell_map_ms += again.ms();
    }
    uploaded += *more;
    if (held_->volume->is_atlas())
        uploaded += show_needed(commands);
    keep_gradients(scene, data.volume, commands);
    return uploaded;
}

bool Renderer::wants_gradients(const Scene& scene) const {
    return options_.stored_gradients && scene.ray_cast && scene.ray_cast->mode == RayMode::alpha &&
           scene.ray_cast->shading && options_.sampling == Sampling::device;
}

// After the volume, for shaded alpha: fills what its rays may read.
void Renderer::keep_gradients(const Scene& scene, const Volume& volume, Commands& commands) {
    held_->gradients_ms = 0;
    std::optional<GradientImage>& held = held_->gradients;
    const bool wanted = wants_gradients(scene) && !held_->volume->is_atlas();
    if (!wanted || (held && (held->snapshot().size() != volume.size() ||
                             held->snapshot().type() != volume.type()))) {
        if (held)
            finish(commands);
        held.reset();
    }
    if (!wanted)
        return;
    std::optional<GpuVolume> nothing;
    if (!held && GradientImage::bytes_for(volume) > free_bytes(nothing))
        return;
    if (!held) {
        held.emplace(*device_, volume);
        held_->gradients_filled_for.reset();
    } else if (!volume.is_same_as(held->snapshot())) {
        held->update(volume, changed_bricks(held->snapshot(), volume));
        held_->gradients_filled_for.reset();
    }
    const Timer timer;
    const std::pair filled_for(*scene.ray_cast, step_factor_);
    if (held_->gradients_filled_for == filled_for)
        return;
    held->fill(held_->needed->seen(), commands);
    held_->gradients_filled_for = filled_for;
    held_->gradients_ms = timer.ms();
}

// What the volume may take: some is kept for what is made after it.
uint64_t Renderer::room_for_volume(const Scene& scene) {
    uint64_t kept = 1 << 20; // tables, uniforms, lists of tiles
    if (scene.ray_cast)      // macro-cells of a MIP with their staging
        kept += 8 * held_->cells->cell_count();
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::mip && !held_->slabs)
        kept += slab_bytes(scene);
    const uint64_t free = free_bytes(held_->volume);
    return free - std::min(free, kept);
}

void Renderer::find_needed_bricks(const Scene& scene, const Volume& volume,
                                  std::span<const ChangedBrick> changed) {
    held_->parts.clear();
    held_->needed_bricks = 0;
    const glm::uvec3 size = volume.size();
    const bool fits = std::max({size.x, size.y, size.z}) <= device_->limits().maxImageDimension3D &&
                      sample_count(volume.grid()) * sizeof(float) <= room_for_volume(scene) / 2;
    const bool in_atlas = held_->volume && held_->volume->is_atlas(); // and may stay there
    const bool dense = options_.residency == Residency::dense ||      // whatever can be seen
                       (options_.residency == Residency::automatic && fits && !in_atlas);
    if (dense && !wants_gradients(scene)) {
        held_->needed.reset();
        return;
    }
    if (!held_->needed) {
        held_->needed.emplace(volume);
        held_->all_fit = false;
    }
    held_->needed->update(scene, volume, changed, held_->cells ? &*held_->cells : nullptr,
                          step_factor_);
    if (!dense)
        held_->needed_bricks = held_->needed->count();
}

// Of an atlas: brings what came to be needed into it, where it has room for all that is.
size_t Renderer::show_needed(Commands& commands) {
    BrickAtlas& atlas = held_->volume->atlas();
    NeededBricks& needed = *held_->needed;
    const bool in_step = held_->all_fit;
    const std::vector<glm::uvec3> turned = needed.take_turned();
    held_->all_fit = needed.count() <= atlas.capacity();
    if (!held_->all_fit)
        return 0;
    if (in_step)
        for (const glm::uvec3 brick : turned)
            atlas.want(brick, needed.needs(brick));
    else
        atlas.want_only(needed.all());
    return atlas.upload_wanted(held_->volume->snapshot(), commands);
}

Result<void> Renderer::plan_atlas(const Scene& scene, const SceneData& data) {
    const size_t room = held_->volume->atlas().capacity();
    if (held_->needed->sliced_count() > room)
        return fail("the volume: its slices run through {} bricks, and the device has room for {}",
                    held_->needed->sliced_count(), room);
    if (!scene.ray_cast)
        return {};
    if (held_->all_fit) {
        held_->parts = {{glm::uvec3(0), data.volume.brick_count(), all_eyes(scene), {}}};
    } else {
        std::vector<Viewpoint> viewpoints;
        for (const View& view : views_of(scene))
            viewpoints.push_back(viewpoint_of(view, data.volume.grid()));
        Result<std::vector<Part>> parts = plan_parts(
            data.volume.brick_count(), held_->needed->seen(), room,
            reach_samples(*scene.ray_cast, data.volume.grid(), step_factor_), viewpoints);
        if (!parts)
            return pass_on(parts);
        if (parts->size() > 1 && scene.ray_cast->mode == RayMode::mip && held_->targets->layers)
            return fail(
                "the volume: a MIP behind see-through surfaces needs all of it on the device, "
                "which has room for {} of the {} bricks that can be seen",
                room, held_->needed->seen_count());
        held_->parts = std::move(*parts);
    }
    if (!held_->targets->carry)
        held_->targets->carry.emplace(*device_, "carried by rays", carry_shape(scene));
    return {};
}

void Renderer::bind_atlas(std::vector<Bound>& bound, uint32_t pages, uint32_t frame) {
    if (!held_->volume->is_atlas())
        return;
    bound.push_back(bind_sampled(pages, held_->volume->atlas().table(), nearest_));
    bound.push_back(bind_uniform(frame, *held_->atlas_frame));
}

size_t Renderer::show_part(const Part& part, bool first, Commands& commands) {
    if (!held_->volume->is_atlas())
        return 0;
    BrickAtlas& atlas = held_->volume->atlas();
    size_t uploaded = 0;
    if (!held_->all_fit) {
        atlas.want_only(part.bricks);
        uploaded = atlas.upload_wanted(held_->volume->snapshot(), commands);
    }
    held_->atlas_frame =
        commands.upload(bytes_of(make_atlas_frame(atlas, held_->volume->snapshot(), part, first)));
    return uploaded;
}

void Renderer::tell_residency(FrameStats& stats) const {
    if (!held_->volume) {
        stats.residency_reason = "nothing in the scene shows voxels";
        return;
    }
    stats.atlas = held_->volume->is_atlas();
    stats.residency_reason = held_->volume->reason();
    stats.needed_bricks = held_->needed_bricks;
    if (stats.atlas) {
        stats.room_for_bricks = held_->volume->atlas().capacity();
        stats.parts = std::max<size_t>(1, held_->parts.size());
    }
}

} // namespace palpate
