// The passes of a frame, as commands.

#include <limits>

#include "engine/render/held.h"
#include "shaders/shared/ray_cast.h"
#include "shaders/shared/slices.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// A submission on a device with a watchdog takes at most about this many samples: 50 ms at 2e10
// samples a second, a tenth of what a large GPU reaches.
constexpr double kSamplesPerSubmission = 1e9;

} // namespace

bool takes_slabs(const RayCastVariant& variant) {
    return variant.mode == gpu::kModeMip && variant.skip && !variant.exact;
}

uint32_t eye_count(const Scene& scene) {
    return scene.stereo ? 2 : 1;
}

uint32_t all_eyes(const Scene& scene) {
    return (1u << eye_count(scene)) - 1u;
}

glm::uvec2 tile_count(glm::uvec2 rays) {
    return (rays + (gpu::kTileSide - 1)) / gpu::kTileSide;
}

size_t slab_bytes(const Scene& scene) {
    const glm::uvec2 count = tile_count(scene.size_px);
    return size_t{count.x} * count.y * eye_count(scene) * gpu::kMipWords * sizeof(uint32_t);
}

uint32_t tile_rows_per_submission(const GpuDevice& device, const Scene& scene, const Grid& grid) {
    const glm::uvec2 count = tile_count(scene.size_px);
    const uint32_t tiles_per_row = count.x * eye_count(scene);
    const uint32_t most = std::max(1u, device.limits().maxComputeWorkGroupCount[0] / tiles_per_row);
    const uint32_t rows = std::min(count.y, most);
    if (device.info().is_cpu() || !scene.ray_cast)
        return rows;
    const glm::dvec3 extent_mm = spacing_mm(grid) * glm::dvec3(grid.size);
    // The exact integrator fetches eight corners of every cell on its way.
    const double per_ray = scene.ray_cast->integrator == Integrator::exact
                               ? 8.0 * (0.0 + grid.size.x + grid.size.y + grid.size.z)
                               : glm::length(extent_mm) / step_mm_of(*scene.ray_cast, grid);
    const double per_row = per_ray * scene.size_px.x * gpu::kTileSide * eye_count(scene);
    return std::clamp(static_cast<uint32_t>(kSamplesPerSubmission / per_row), 1u, rows);
}

std::vector<View> views_of(const Scene& scene) {
    if (!scene.stereo)
        return {make_view(scene.camera, scene.size_px)};
    const auto pair = make_stereo_views(scene.camera, scene.stereo->rig, scene.size_px);
    return {pair.begin(), pair.end()};
}

void Renderer::record_slices(Commands& commands, const Scene& scene) {
    Targets& targets = *held_->targets;
    std::vector<Bound> bound{
        bind_uniform(gpu::kSliceFrame, *held_->slice_frame),
        bind_sampled(gpu::kSliceVolume, held_->volume->image(), linear_),
        bind_sampled(gpu::kSliceTable, held_->slice_transfer->image(), nearest_)};
    if (scene.labels) {
        bound.push_back(bind_sampled(gpu::kSliceLabels, held_->labels->image(), label_sampler_));
        bound.push_back(bind_storage(gpu::kSliceStyles, held_->styles.get()));
    }
    bound.push_back(bind_uniform(gpu::kSlicePlanes, *held_->planes));
    const bool behind = targets.behind.has_value();
    bound.push_back(
        bind_storage_image(gpu::kSliceColor, behind ? *targets.behind : *targets.color));
    bound.push_back(
        bind_storage_image(gpu::kSliceValues, behind ? *targets.behind_values : *targets.values));
    bind_atlas(bound, gpu::kSlicePages, gpu::kSliceAtlas);
    commands.begin_pass("slices");
    commands.dispatch(pipelines_.slices(scene.labels.has_value(), held_->volume->is_atlas(),
                                        options_.sampling == Sampling::by_hand),
                      bound, {tile_count(scene.size_px), eye_count(scene)});
    commands.end_pass();
}

void Renderer::record_surfaces(Commands& commands, const Scene& scene) {
    Targets& targets = *held_->targets;
    if (scene.slices.empty()) {
        commands.clear(*targets.behind, glm::vec4(glm::vec3(scene.background), 0.0f));
        commands.clear(*targets.behind_values, glm::vec4(std::numeric_limits<float>::quiet_NaN()));
    }
    held_->surfaces->record(
        commands, pipelines_,
        {*targets.behind, *targets.behind_values, *targets.color,
         targets.values ? &*targets.values : nullptr, targets.layers ? &*targets.layers : nullptr});
}

void Renderer::record_background(Commands& commands, const Scene& scene) {
    Targets& targets = *held_->targets;
    commands.begin_pass("background");
    if (targets.behind)
        commands.copy(*targets.behind, *targets.color);
    else
        commands.clear(*targets.color, glm::vec4(glm::vec3(scene.background), 0.0f));
    if (scene.value_and_depth) {
        if (targets.behind_values)
            commands.copy(*targets.behind_values, *targets.values);
        else
            commands.clear(*targets.values, glm::vec4(std::numeric_limits<float>::quiet_NaN()));
    }
    commands.end_pass();
}

void Renderer::record_tiles(Commands& commands, RayPass& pass, uint32_t eyes, uint32_t which,
                            uint32_t first_row, uint32_t rows) {
    constexpr uint32_t none[gpu::kTileGroupWords] = {0, 1, 1, 0, 1, 1};
    const bool spans = pass.spans != nullptr;
    commands.begin_pass("tiles");
    commands.fill(pass.groups, none);
    const Bound bound[] = {
        bind_uniform(gpu::kTileFrame, pass.frame),
        bind_sampled(gpu::kTileCells, held_->cells->image(), nearest_),
        bind_storage(gpu::kTileGroups, pass.groups, Use::storage_write),
        bind_storage(gpu::kTileEntries, pass.list, Use::storage_write),
        // the pipeline has a place for spans; where there are none it writes none
        bind_storage(gpu::kTileSpans, spans ? *pass.spans : pass.list, Use::storage_write)};
    const uint32_t across = (tile_count(pass.rays).x + 63) / 64;
    commands.dispatch(pipelines_.tiles(which, spans), bound, {across, rows, eyes},
                      {0, first_row, 0});
    commands.end_pass();
    if (!pass.slabs)
        return;
    const Bound of_slabs[] = {bind_uniform(gpu::kTileFrame, pass.frame),
                              bind_sampled(gpu::kTileCells, held_->cells->image(), nearest_),
                              bind_storage(gpu::kTileEntries, pass.list),
                              bind_storage(gpu::kTileSlabs, *pass.slabs, Use::storage_write)};
    commands.begin_pass("slabs");
    commands.dispatch_indirect(pipelines_.mip_slabs(), of_slabs, pass.groups);
    commands.end_pass();
}

void Renderer::record_ray_cast(Commands& commands, const RayPass& pass, const Scene& scene) {
    Targets& targets = *held_->targets;
    std::vector<Bound> bound{bind_uniform(gpu::kRayFrame, pass.frame),
                             bind_sampled(gpu::kRayVolume, held_->volume->image(), linear_)};
    if (pass.table)
        bound.push_back(bind_sampled(gpu::kRayTable, *pass.table, nearest_));
    if (pass.table) // the pipeline has a place for gradients; where there are none it reads none
        bound.push_back(bind_sampled(
            gpu::kRayGradients,
            held_->gradients ? held_->gradients->image() : held_->volume->image(), linear_));
    if (pass.table) // so with slabs
        bound.push_back(bind_storage(gpu::kRaySlabs, pass.slabs ? *pass.slabs : pass.list));
    if (held_->variant.exact) {
        bound.push_back(bind_sampled(gpu::kRayCorners, held_->volume->image(), nearest_));
        if (pass.table)
            bound.push_back(bind_sampled(gpu::kRaySmoothTable, *pass.table, linear_));
    }
    if (scene.labels) {
        bound.push_back(bind_sampled(gpu::kRayLabels, held_->labels->image(), label_sampler_));
        bound.push_back(bind_storage(gpu::kRayStyles, held_->styles.get()));
    }
    if (pass.variant.slices) {
        bound.push_back(bind_sampled(gpu::kRayBehind, *targets.behind, nearest_));
        bound.push_back(bind_sampled(gpu::kRayBehindValues, *targets.behind_values, nearest_));
    }
    if (pass.variant.has_first_hits()) {
        const bool leaves = pass.variant.rays == gpu::kRaysEverySecond;
        bound.push_back(bind_storage(gpu::kRayFirstHits,
                                     pass.first_hits ? *pass.first_hits : pass.groups,
                                     leaves ? Use::storage_write : Use::storage_read));
    }
    bound.push_back(bind_storage_image(gpu::kRayColor, pass.color));
    if (pass.variant.values)
        bound.push_back(bind_storage_image(gpu::kRayValues, *pass.values));
    bound.push_back(bind_sampled(gpu::kRayCells, held_->cells->image(), nearest_));
    bound.push_back(bind_storage(gpu::kRayTiles, pass.list,
                                 pass.variant.count ? Use::storage_write : Use::storage_read));
    bound.push_back(bind_storage(gpu::kRayTileGroups, pass.groups));
    bound.push_back(bind_storage(gpu::kRaySpans, pass.spans ? *pass.spans : pass.groups));
    bind_atlas(bound, gpu::kRayPages, gpu::kRayAtlas);
    if (pass.variant.atlas)
        bound.push_back(bind_storage_image(gpu::kRayCarry, *targets.carry));
    if (pass.variant.layers > 0)
        bound.push_back(bind_sampled(gpu::kRaySurfaces, *targets.layers, nearest_));
    commands.begin_pass(pass.name);
    commands.dispatch_indirect(pipelines_.ray_cast(pass.variant), bound, pass.groups,
                               pass.variant.rays == gpu::kRaysEverySecond ? gpu::kTileQuarters : 0);
    commands.end_pass();
}

} // namespace palpate
