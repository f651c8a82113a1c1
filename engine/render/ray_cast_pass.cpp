#include "engine/render/ray_cast_pass.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/option_name.h"
#include "engine/gpu/offer.h"
#include "engine/render/frame_block.h"
#include "shaders/shared/ray_cast.h"
#include "spirv/mip_slabs.h"
#include "spirv/tiles.h"

namespace palpate {

namespace {

// A submission on a device with a watchdog takes at most about this many samples: 50 ms at 2e10
// samples a second, a tenth of what a large GPU reaches.
constexpr double kSamplesPerSubmission = 1e9;

// Rows of tiles that one submission marches: as many as a dispatch has workgroups for, and on a
// device with a watchdog no more than take a moment.
uint32_t tile_rows_per_submission(const GpuDevice& device, const Scene& scene, const Grid& grid) {
    const glm::uvec2 count = tile_count(scene.size_px);
    const uint32_t tiles_per_row = count.x * eye_count(scene);
    const uint32_t most = std::max(1u, device.limits().maxComputeWorkGroupCount[0] / tiles_per_row);
    const uint32_t rows = std::min(count.y, most);
    if (device.info().is_cpu())
        return rows;
    const glm::dvec3 extent_mm = spacing_mm(grid) * glm::dvec3(grid.size);
    // The exact integrator fetches eight corners of every cell on its way.
    const double per_ray = scene.ray_cast->integrator == Integrator::exact
                               ? 8.0 * (0.0 + grid.size.x + grid.size.y + grid.size.z)
                               : glm::length(extent_mm) / step_mm_of(*scene.ray_cast, grid);
    const double per_row = per_ray * scene.size_px.x * gpu::kTileSide * eye_count(scene);
    return std::clamp(static_cast<uint32_t>(kSamplesPerSubmission / per_row), 1u, rows);
}

size_t tiles_of(const Scene& scene) {
    const glm::uvec2 count = tile_count(scene.size_px);
    return size_t{count.x} * count.y * eye_count(scene);
}

size_t slab_bytes(const Scene& scene) {
    return tiles_of(scene) * gpu::kMipWords * sizeof(uint32_t);
}

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

uint32_t mode_of(RayMode mode) {
    switch (mode) {
        case RayMode::mip:
            return gpu::kModeMip;
        case RayMode::alpha:
            return gpu::kModeAlpha;
        case RayMode::iso:
            return gpu::kModeIso;
    }
    return gpu::kModeAlpha;
}

RayCastVariant variant_of(const Scene& scene, const Volume& volume, bool among_layers,
                          const RendererOptions& options) {
    const RayCastLayer& layer = *scene.ray_cast;
    RayCastVariant variant;
    variant.mode = mode_of(layer.mode);
    const bool alpha = layer.mode == RayMode::alpha;
    variant.preintegrated = alpha && layer.integrator == Integrator::preintegrated;
    variant.exact = layer.integrator == Integrator::exact;
    variant.shaded = alpha && layer.shading.has_value();
    variant.light = layer.mode != RayMode::mip && layer.light.has_value();
    variant.occlusion = layer.mode == RayMode::iso && layer.occlusion_mm > 0.0;
    variant.labels = scene.labels && scene.labels->ray_cast_weight > 0.0;
    variant.slices = !scene.slices.empty() || !scene.surfaces.empty();
    variant.values = scene.value_and_depth;
    variant.no_data = volume.no_data_count() > 0;
    if (layer.mode == RayMode::iso)
        variant.iso_count = static_cast<uint32_t>(layer.isos.size());
    variant.skip = options.skipping;
    variant.by_hand = options.sampling == Sampling::by_hand;
    variant.layers = among_layers ? scene.surface_depth : 0;
    return variant;
}

// Whether the beams of a MIP's tiles are narrow enough to meet cells that differ: up to four of
// them wide at the far end.
bool pays_in_slabs(const gpu::Frame& frame) {
    const auto widest = [](const gpu::FrameEye& eye) {
        return 2.0f * (eye.spread.x + eye.spread.y * eye.reach);
    };
    return std::max(widest(frame.eyes[0]), widest(frame.eyes[1])) <= 4.0f * frame.cell_side;
}

} // namespace

uint64_t count_segments(const Scene& scene, const Grid& grid) {
    const double step = step_mm_of(*scene.ray_cast, grid);
    const glm::dmat4 to_index = index_from_world(grid);
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    uint64_t count = 0;
    for (const View& view : views_of(scene))
        for (uint32_t y = 0; y < scene.size_px.y; ++y)
            for (uint32_t x = 0; x < scene.size_px.x; ++x) {
                const Ray ray = ray_through(view, {x, y}, scene.size_px);
                const glm::dvec3 origin = index_point(grid, ray.origin_mm);
                const glm::dvec3 direction = glm::dmat3(to_index) * ray.direction;
                double near = 0.0, far = std::numeric_limits<double>::infinity();
                for (int axis = 0; axis < 3; ++axis) {
                    if (direction[axis] == 0.0) {
                        if (origin[axis] < 0.0 || origin[axis] > last[axis])
                            far = -1.0;
                        continue;
                    }
                    const double a = -origin[axis] / direction[axis];
                    const double b = (last[axis] - origin[axis]) / direction[axis];
                    near = std::max(near, std::min(a, b));
                    far = std::min(far, std::max(a, b));
                }
                if (near < far)
                    count += static_cast<uint64_t>(std::ceil(far / step) - std::floor(near / step));
            }
    return count;
}

bool RayCastPass::takes_slabs(const RayCastVariant& variant) {
    return variant.mode == gpu::kModeMip && variant.skip && !variant.exact;
}

uint32_t RayCastPass::tiles_to_list(const Scene& scene) const {
    // A MIP passes over nothing before it has met something. A cap lies where clip planes cut into
    // values above an iso-value, not where those change.
    const bool capped = scene.ray_cast->mode == RayMode::iso && !scene.clip_planes.empty();
    const bool visible =
        store_->options.skipping && scene.ray_cast->mode != RayMode::mip && !capped;
    return visible ? gpu::kListVisible : gpu::kListBox;
}

VolumeResidency::Wish RayCastPass::begin(const Scene& scene, const SceneData& data,
                                         bool among_layers, double step_factor) {
    if (size_px_ != scene.size_px || eyes_ != eye_count(scene)) {
        tiles_.reset();
        slabs_.reset();
        carry_.reset();
        size_px_ = scene.size_px;
        eyes_ = eye_count(scene);
    }
    if (!store_->volume.has_volume()) {
        RayCastVariant variant = variant_of(scene, data.volume, among_layers, store_->options);
        variant.atlas = store_->options.residency == Residency::atlas;
        variant.stored_gradients =
            store_->options.stored_gradients && variant.shaded && !variant.by_hand;
        store_->pipelines.get(variant);
        store_->pipelines.get(spirv::Tiles{.list = tiles_to_list(scene)});
        if (takes_slabs(variant))
            store_->pipelines.get(spirv::MipSlabs{});
    }
    return {.step_factor = step_factor,
            .kept_bytes = scene.ray_cast->mode == RayMode::mip && !slabs_ ? slab_bytes(scene) : 0,
            .carried_bytes = carry_ ? 0 : carry_bytes(scene)};
}

void RayCastPass::prepare(const ViewFrame& frame, bool count) {
    const Scene& scene = frame.scene;
    const RayCastLayer& layer = *scene.ray_cast;
    listed_.clear();
    timed_.clear();
    if (layer.mode == RayMode::iso) // surfaces have colours of their own
        store_->transfers.drop(table_);
    else
        store_->take_table(table_, layer.transfer, step_mm_of(layer, frame.data.volume.grid()),
                           frame.commands);
    FrameInputs inputs = frame.inputs(table_.get());
    inputs.cells = frame.voxels.cells().count();
    inputs.cell_side = frame.voxels.cells().side();
    inputs.cell_margin = frame.voxels.cells().margin();
    block_ = make_frame_block(scene, frame.data, frame.views, inputs);
    uploaded_block_ = frame.commands.upload(bytes_of(block_));
    variant_ =
        variant_of(scene, frame.data.volume, frame.targets.layers.has_value(), store_->options);
    variant_.skip = variant_.skip && (!takes_slabs(variant_) || pays_in_slabs(block_));
    variant_.count = count;
    variant_.atlas = frame.voxels.volume().is_atlas();
    variant_.stored_gradients = frame.voxels.gradients() != nullptr;
    if (!variant_.atlas)
        carry_.reset();
    else if (!carry_)
        carry_.emplace(store_->device, "carried by rays", carry_shape(scene));
    if (!takes_slabs(variant_))
        slabs_.reset();
    else if (!slabs_)
        slabs_.emplace(store_->device, "MIP slabs", slab_bytes(scene), Memory::device);
    if (!tile_groups_)
        tile_groups_.emplace(store_->device, "tile count", gpu::kTileGroupWords * sizeof(uint32_t),
                             Memory::device);
    if (!tiles_)
        tiles_.emplace(store_->device, "tiles", tiles_of(scene) * sizeof(gpu::TileEntry),
                       Memory::device);
}

RayCastPass::Rays RayCastPass::all_rays(const ViewFrame& frame) {
    Targets& targets = frame.targets;
    return {"ray cast",
            variant_,
            frame.scene.size_px,
            *uploaded_block_,
            table_ ? &table_->image() : nullptr,
            &*targets.color,
            targets.values ? &*targets.values : nullptr,
            &*tile_groups_,
            &*tiles_,
            slabs_ ? &*slabs_ : nullptr};
}

Result<size_t> RayCastPass::record(const ViewFrame& frame) {
    const Rays rays = all_rays(frame);
    if (variant_.atlas && variant_.occlusion) // whose bricks are those that rays from the eye need
        return fail(
            "ambient occlusion: expected a volume that lies in one image of the device, found one "
            "that is kept in bricks ({})",
            Option{"residency"});
    const size_t parts = frame.voxels.part_count();
    size_t uploaded = 0;
    for (size_t part = 0; part < parts; ++part) {
        if (parts > 1) {
            const double share = static_cast<double>(part) / static_cast<double>(parts);
            const auto& progress = store_->options.progress;
            if (progress && !progress(share))
                return fail("drawing was stopped after {} of {} parts", part, parts);
            frame.commands.flush(); // the device draws one part while the next is read
        }
        uploaded += frame.voxels.show_part(part, frame.commands);
        cast_tiles(frame, rays, tiles_to_list(frame.scene), all_tiles(frame.scene.size_px));
    }
    return uploaded;
}

void RayCastPass::record_tiles(const ViewFrame& frame, const gpu::TileRange& range) {
    // Every tile is marched, also those that see nothing: what lies there is replaced.
    cast_tiles(frame, all_rays(frame), gpu::kListAll, range);
}

gpu::TileRange RayCastPass::all_tiles(glm::uvec2 rays) {
    return {glm::uvec2(0), tile_count(rays)};
}

bool RayCastPass::cast_tiles(const ViewFrame& frame, const Rays& rays, uint32_t which,
                             const gpu::TileRange& range) {
    const uint32_t band =
        tile_rows_per_submission(store_->device, frame.scene, frame.data.volume.grid());
    for (uint32_t row = range.first.y; row < range.end.y; row += band) {
        if (row > range.first.y)
            frame.commands.flush();
        list_tiles(frame, rays, which,
                   {{range.first.x, row}, {range.end.x, std::min(row + band, range.end.y)}});
        cast(frame, rays);
        if (rays.variant.count)
            listed_.push_back(
                {frame.commands.read_back(*rays.list), frame.commands.read_back(*rays.groups)});
    }
    return band < range.end.y - range.first.y;
}

void RayCastPass::list_tiles(const ViewFrame& frame, const Rays& rays, uint32_t which,
                             const gpu::TileRange& range) {
    constexpr uint32_t none[gpu::kTileGroupWords] = {0, 1, 1, 0, 1, 1};
    Commands& commands = frame.commands;
    GpuImage& cells = frame.voxels.cells().image();
    const bool spans = rays.spans != nullptr;
    commands.begin_pass("tiles");
    commands.fill(*rays.groups, none);
    const Bound bound[] = {
        bind_uniform(gpu::kTileFrame, rays.block),
        bind_sampled(gpu::kTileCells, cells, store_->nearest),
        bind_uniform(gpu::kTileRange, commands.upload(bytes_of(range))),
        bind_storage(gpu::kTileGroups, *rays.groups, Use::storage_write),
        bind_storage(gpu::kTileEntries, *rays.list, Use::storage_write),
        bind_storage(gpu::kTileSpans, *or_unused(rays.spans), Use::storage_write)};
    const glm::uvec2 count = range.end - range.first;
    commands.dispatch(store_->pipelines.get(spirv::Tiles{.list = which, .write_spans = spans}),
                      bound, {(count.x + 63) / 64, count.y, eye_count(frame.scene)});
    commands.end_pass();
    if (!rays.slabs)
        return;
    const Bound of_slabs[] = {bind_uniform(gpu::kTileFrame, rays.block),
                              bind_sampled(gpu::kTileCells, cells, store_->nearest),
                              bind_storage(gpu::kTileEntries, *rays.list),
                              bind_storage(gpu::kTileSlabs, *rays.slabs, Use::storage_write)};
    commands.begin_pass("slabs");
    commands.dispatch_indirect(store_->pipelines.get(spirv::MipSlabs{}), of_slabs, *rays.groups);
    commands.end_pass();
}

void RayCastPass::cast(const ViewFrame& frame, const Rays& rays) {
    Targets& targets = frame.targets;
    VolumeUse& voxels = frame.voxels;
    const Sampler &linear = store_->linear, &nearest = store_->nearest;
    const RayCastVariant& variant = rays.variant;
    GpuImage& volume = voxels.volume().image();
    // Variants without stored gradients have a place for them and do not read it.
    GpuImage* const gradients = voxels.gradients() ? voxels.gradients() : &volume;
    const bool may_write_hits = variant.rays == gpu::kRaysEverySecond || !rays.first_hits;
    Offer offer;
    offer.uniform(gpu::kRayFrame, rays.block)
        .sampled(gpu::kRayVolume, &volume, linear)
        .sampled(gpu::kRayTable, rays.table, nearest)
        .sampled(gpu::kRayGradients, gradients, linear)
        .storage(gpu::kRaySlabs, or_unused(rays.slabs))
        .sampled(gpu::kRayCorners, &volume, nearest)
        .sampled(gpu::kRaySmoothTable, rays.table, linear)
        .sampled(gpu::kRayLabels, voxels.labels(), store_->label_sampler)
        .storage(gpu::kRayStyles, frame.styles ? &frame.styles->buffer.get() : nullptr)
        .sampled(gpu::kRayBehind, pointer_to(targets.behind), nearest)
        .sampled(gpu::kRayBehindValues, pointer_to(targets.behind_values), nearest)
        .storage_image(gpu::kRayColor, rays.color)
        .storage_image(gpu::kRayValues, rays.values)
        .sampled(gpu::kRayCells, &voxels.cells().image(), nearest)
        .storage(gpu::kRayTiles, rays.list, variant.count ? Use::storage_write : Use::storage_read)
        .storage(gpu::kRayTileGroups, rays.groups)
        .storage(gpu::kRaySpans, or_unused(rays.spans))
        // after all places of the unused buffer that are read: the last use is what counts
        .storage(gpu::kRayFirstHits, or_unused(rays.first_hits),
                 may_write_hits ? Use::storage_write : Use::storage_read)
        .storage_image(gpu::kRayCarry, pointer_to(carry_))
        .sampled(gpu::kRaySurfaces, pointer_to(targets.layers), nearest);
    voxels.offer_atlas(offer, gpu::kRayPages, gpu::kRayAtlas, nearest);
    const ComputePipeline& pipeline = store_->pipelines.get(variant);
    if (rays.is_picture)
        timed_.push_back(frame.commands.pass_count());
    frame.commands.begin_pass(rays.name);
    frame.commands.dispatch_indirect(
        pipeline, offer.taken_by(pipeline), *rays.groups,
        variant.rays == gpu::kRaysEverySecond ? gpu::kTileQuarters : 0);
    frame.commands.end_pass();
}

uint64_t RayCastPass::read_sample_counts() {
    uint64_t samples = 0;
    for (const Listed& listed : listed_) {
        uint32_t count = 0;
        std::memcpy(&count, listed.groups.mapped().data(), sizeof count);
        for (uint32_t i = 0; i < count; ++i) {
            gpu::TileEntry entry;
            std::memcpy(&entry, listed.tiles.mapped().data() + i * sizeof entry, sizeof entry);
            samples += entry.samples;
        }
    }
    listed_.clear();
    return samples;
}

} // namespace palpate
