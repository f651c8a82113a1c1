// Pictures from fewer rays than they have pixels, and their refinement.

#include <cmath>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/base/timer.h"
#include "engine/render/held.h"
#include "shaders/shared/interactive.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// `block` for rays through other pixels: one in px_per_ray both ways.
gpu::Frame sparser(gpu::Frame block, glm::uvec2 rays, glm::uvec2 first_px, float px_per_ray) {
    block.rays = rays;
    block.first_px = glm::vec2(first_px);
    block.px_per_ray = px_per_ray;
    for (gpu::FrameEye& eye : block.eyes)
        eye.spread *= px_per_ray; // a tile covers more pixels
    return block;
}

size_t tile_bytes(glm::uvec2 rays, uint32_t eyes) {
    const glm::uvec2 count = tile_count(rays);
    return size_t{count.x} * count.y * eyes * sizeof(gpu::TileEntry);
}

double step_factor_of(const RayCastLayer& layer, const CoarseSettings& settings) {
    return layer.integrator != Integrator::exact ? std::max(1.0, settings.step_factor) : 1.0;
}

double contrast_of(RayMode mode, const CoarseSettings& settings) {
    return settings.contrast.value_or(mode == RayMode::iso ? 0.115 : 0.06);
}

} // namespace

void Renderer::keep_coarse_targets(const Scene& scene) {
    std::optional<Coarse>& held = held_->coarse;
    const uint32_t eyes = eye_count(scene);
    if (held && (held->size_px != scene.size_px || held->eyes != eyes))
        held.reset();
    if (!held) {
        const glm::uvec2 size = scene.size_px;
        const glm::uvec2 tiles = tile_count(size);
        const glm::uvec2 probes = (size + (kJudgedSpacing_px - 1)) / kJudgedSpacing_px;
        const size_t pixels = size_t{size.x} * size.y * eyes;
        const size_t second_count = size_t{(size.x + 1) / 2} * ((size.y + 1) / 2) * eyes;
        const size_t probe_count = size_t{probes.x} * probes.y * eyes;
        const ImageShape sparse{.format = VK_FORMAT_R32G32B32A32_SFLOAT,
                                .size = {probes, 1},
                                .layers = eyes,
                                .storage = true};
        const ImageShape few{.format = VK_FORMAT_R32G32B32A32_SFLOAT,
                             .size = {(size + 3u) / 4u, 1},
                             .layers = eyes,
                             .storage = true};
        held.emplace(Coarse{
            size, probes, eyes, GpuImage(*device_, "sparse pixels", sparse),
            GpuImage(*device_, "few pixels", few),
            Buffer(*device_, "tiles' spans", size_t{tiles.x} * tiles.y * eyes * sizeof(glm::vec2),
                   Memory::device),
            Buffer(*device_, "sparse tile count", gpu::kTileGroupWords * sizeof(uint32_t),
                   Memory::device),
            Buffer(*device_, "sparse tiles", tile_bytes(probes, eyes), Memory::device),
            Buffer(*device_, "listed ray count", gpu::kRayGroupWords * sizeof(uint32_t),
                   Memory::device),
            Buffer(*device_, "listed rays", pixels * sizeof(uint32_t), Memory::device),
            Buffer(*device_, "first hits", second_count * sizeof(float), Memory::device),
            Buffer(*device_, "squared errors", probe_count * sizeof(float), Memory::device)});
    }
}

void Renderer::keep_coarse(const Scene& scene, const SceneData& data,
                           const CoarseSettings& settings, Commands& commands) {
    std::optional<Coarse>& held = held_->coarse;
    // The step of the rays between the sparse ones of full quality.
    const RayCastLayer& layer = *scene.ray_cast;
    const double factor = step_factor_of(layer, settings);
    const double step_mm = step_mm_of(layer, data.volume.grid()) * factor;
    const bool has_table = factor != 1.0 && held_->transfer;
    if (!has_table)
        held->transfer.reset();
    else if (!held->transfer)
        held->transfer.emplace(*device_, "coarse transfer function");
    if (has_table)
        held->transfer->hold(layer.transfer, step_mm, commands);

    gpu::Frame coarse = held_->block;
    coarse.step = static_cast<float>(step_mm);
    held->frame = commands.upload(bytes_of(coarse));
    if (settings.px_per_ray > 2) {
        const uint32_t apart = settings.px_per_ray;
        held->few_rays = (scene.size_px + (apart - 1)) / apart;
        const glm::uvec2 first_px = (scene.size_px - 1u - apart * (held->few_rays - 1u)) / 2u;
        held->few_frame = commands.upload(
            bytes_of(sparser(coarse, held->few_rays, first_px, static_cast<float>(apart))));
        const gpu::EnlargeBlock enlarge{scene.size_px, held->few_rays, first_px, apart};
        held->enlarge = commands.upload(bytes_of(enlarge));
    }
    // 4 and 7 have no factor in common with the spacing: other places come by in turn.
    const glm::uvec2 first(4 * held->drawn % kJudgedSpacing_px,
                           7 * held->drawn % kJudgedSpacing_px);
    ++held->drawn;
    held->first_probe = glm::min(first, scene.size_px - 1u);
    held->probes =
        (scene.size_px - held->first_probe + (kJudgedSpacing_px - 1)) / kJudgedSpacing_px;
    held->probe_frame = commands.upload(
        bytes_of(sparser(held_->block, held->probes, held->first_probe, float{kJudgedSpacing_px})));
    const gpu::InterpolateBlock interpolate{scene.size_px,
                                            static_cast<float>(contrast_of(layer.mode, settings))};
    held->interpolate = commands.upload(bytes_of(interpolate));
    const gpu::JudgeBlock judge{held->probes, held->first_probe, kJudgedSpacing_px};
    held->judge = commands.upload(bytes_of(judge));
}

void Renderer::record_interpolation(Commands& commands, const Scene& scene) {
    Coarse& coarse = *held_->coarse;
    constexpr uint32_t none[gpu::kRayGroupWords] = {0, 1, 1, 0, 0};
    commands.begin_pass("interpolate");
    commands.fill(coarse.ray_groups, none);
    const Bound bound[] = {
        bind_uniform(gpu::kInterpolateBlock, *coarse.interpolate),
        bind_storage_image(gpu::kInterpolateColor, *held_->targets->color),
        bind_storage(gpu::kInterpolateSpans, coarse.spans),
        bind_storage(gpu::kInterpolateGroups, coarse.ray_groups, Use::storage_write),
        bind_storage(gpu::kInterpolateRays, coarse.rays_listed, Use::storage_write)};
    const glm::uvec2 tiles = tile_count(scene.size_px);
    commands.dispatch(pipelines_.interpolate(), bound, {(tiles.x + 3) / 4, tiles.y, coarse.eyes});
    commands.end_pass();
}

// In place of `every_second`, whose tiles tell where to look, and of the listed pixels.
void Renderer::record_few_rays(Commands& commands, const Scene& scene, RayPass every_second,
                               uint32_t which) {
    Coarse& coarse = *held_->coarse;
    record_tiles(commands, every_second, coarse.eyes, which, 0, tile_rows(scene));
    commands.clear(coarse.few, glm::vec4(glm::vec3(scene.background), 0.0f));
    RayPass few{"few pixels",      held_->variant,      coarse.few_rays,
                *coarse.few_frame, every_second.table,  coarse.few,
                nullptr,           every_second.groups, every_second.list};
    few.variant.rays = gpu::kRaysSparse;
    record_tiles(commands, few, coarse.eyes, scene.surfaces.empty() ? gpu::kListBox : gpu::kListAll,
                 0, tile_count(coarse.few_rays).y);
    few.slabs = every_second.slabs; // of the picture's tiles
    few.spans = &coarse.spans;
    record_ray_cast(commands, few, scene);
    const Bound bound[] = {bind_uniform(gpu::kEnlargeBlock, *coarse.enlarge),
                           bind_sampled(gpu::kEnlargeFew, coarse.few, nearest_),
                           bind_storage_image(gpu::kEnlargeColor, *held_->targets->color),
                           bind_storage(gpu::kEnlargeSpans, coarse.spans)};
    commands.begin_pass("enlarge");
    commands.dispatch(pipelines_.enlarge(), bound, {tile_count(scene.size_px), coarse.eyes});
    commands.end_pass();
}

void Renderer::record_judgement(Commands& commands) {
    Coarse& coarse = *held_->coarse;
    const Bound bound[] = {bind_uniform(gpu::kJudgeBlock, *coarse.judge),
                           bind_sampled(gpu::kJudgeColor, *held_->targets->color, nearest_),
                           bind_sampled(gpu::kJudgeTruth, coarse.truth, nearest_),
                           bind_storage(gpu::kJudgeSquares, coarse.squares, Use::storage_write)};
    commands.begin_pass("judge");
    commands.dispatch(pipelines_.judge(), bound,
                      {(coarse.probes.x + 63) / 64, coarse.probes.y, coarse.eyes});
    commands.end_pass();
}

Result<size_t> Renderer::prepare_interactive(const Scene& scene, const SceneData& data,
                                             double step_factor, Commands& commands) {
    const Restored restored(step_factor_, step_factor);
    Result<size_t> uploaded = prepare_and_wait(scene, data, commands);
    if (uploaded && held_->parts.size() > 1)
        return fail(
            "an interactive frame: expected room on the device for the {} bricks that can be seen, "
            "found room for {}",
            held_->needed_bricks, held_->volume->atlas().capacity());
    return uploaded;
}

Result<CoarseStats> Renderer::draw_coarse(const Scene& scene, const SceneData& data,
                                          const CoarseSettings& settings) {
    return or_from_nothing([&] { return draw_coarse_frame(scene, data, settings); });
}

Result<CoarseStats> Renderer::draw_coarse_frame(const Scene& asked, const SceneData& data,
                                                const CoarseSettings& settings) {
    PALPATE_ASSERT(asked.ray_cast.has_value());
    PALPATE_ASSERT(settings.px_per_ray == 2 || settings.px_per_ray == 4 ||
                   settings.px_per_ray == 8 || settings.px_per_ray == 16);
    Scene scene = asked;
    scene.value_and_depth = false;
    CoarseStats stats;
    keep_coarse_targets(scene); // first: the volume takes what is left
    Commands commands(*device_);
    Result<size_t> uploaded =
        prepare_interactive(scene, data, step_factor_of(*scene.ray_cast, settings), commands);
    if (!uploaded) {
        commands.submit(); // what is recorded is taken for done
        return pass_on(uploaded);
    }
    stats.frame.uploaded_bricks = *uploaded;
    stats.frame.cell_map_ms = held_->cell_map_ms;
    keep_coarse(scene, data, settings, commands);

    Coarse& coarse = *held_->coarse;
    GpuImage* table = coarse.transfer   ? &coarse.transfer->image()
                      : held_->transfer ? &held_->transfer->image()
                                        : nullptr;
    const uint32_t eyes = coarse.eyes;
    const Timer timer;
    stats.frame.uploaded_bricks += draw_behind(scene, data, commands);
    if (!held_->parts.empty()) // slices may show other bricks than rays
        stats.frame.uploaded_bricks += show_part(held_->parts.front(), true, commands);
    commands.clear(coarse.truth, glm::vec4(glm::vec3(scene.background), 0.0f));
    const RayPass full = full_pass(scene);
    RayPass second{
        "every second pixel", held_->variant,    scene.size_px, *coarse.frame, table,
        full.color,           nullptr,           full.groups,   full.list,     full.slabs,
        &coarse.spans,        &coarse.first_hits};
    second.variant.rays = gpu::kRaysEverySecond;
    if (second.variant.has_first_hits())
        commands.zero(coarse.first_hits); // empty tiles have no rays, and leave none
    // Behind the volume there may be slices, and beside it meshes.
    const uint32_t which = !scene.surfaces.empty() ? gpu::kListAll
                           : !scene.slices.empty() ? gpu::kListBox
                                                   : tiles_to_list(scene);
    const uint32_t band = tile_rows_per_submission(*device_, scene, data.volume.grid());
    const uint32_t rows = tile_rows(scene);
    if (settings.px_per_ray > 2) {
        record_few_rays(commands, scene, second, which);
    } else {
        for (uint32_t row = 0; row < rows; row += band) {
            if (row > 0)
                commands.flush();
            record_tiles(commands, second, eyes, which, row, std::min(band, rows - row));
            record_ray_cast(commands, second, scene);
        }
        if (band < rows) // the listed pixels are few but where neighbours differ
            commands.flush();
        record_interpolation(commands, scene);
        RayPass listed{
            "listed pixels", held_->variant,    scene.size_px,     *coarse.frame,      table,
            full.color,      nullptr,           coarse.ray_groups, coarse.rays_listed, full.slabs,
            &coarse.spans,   &coarse.first_hits};
        listed.variant.rays = gpu::kRaysListed;
        record_ray_cast(commands, listed, scene);
    }
    RayPass sparse{"sparse pixels",
                   held_->variant,
                   coarse.probes,
                   *coarse.probe_frame,
                   held_->transfer ? &held_->transfer->image() : nullptr,
                   coarse.truth,
                   nullptr,
                   coarse.tile_groups,
                   coarse.tiles};
    sparse.variant.rays = gpu::kRaysSparse;
    if (takes_slabs(sparse.variant) && coarse.transfer) // slabs count in steps
        sparse.variant.skip = false;
    record_tiles(commands, sparse, eyes, scene.surfaces.empty() ? gpu::kListBox : gpu::kListAll, 0,
                 tile_count(coarse.probes).y);
    sparse.slabs = full.slabs; // of the picture's tiles
    sparse.spans = &coarse.spans;
    record_ray_cast(commands, sparse, scene);
    record_judgement(commands);
    const BufferSlice counts = commands.read_back(coarse.ray_groups);
    const BufferSlice judged = commands.read_back(coarse.squares);
    commands.submit();
    add_times(stats.frame.passes, commands.finish());
    stats.frame.wall_ms = timer.ms();
    tell_residency(stats.frame);

    std::vector<float> squares(size_t{coarse.probes.x} * coarse.probes.y * eyes);
    std::memcpy(squares.data(), judged.mapped().data(), squares.size() * sizeof(float));
    double sum = 0;
    for (const float square : squares)
        sum += square;
    stats.error_estimate = std::sqrt(sum / static_cast<double>(squares.size()));
    stats.first_judged = coarse.first_probe;
    uint32_t words[gpu::kRayGroupWords];
    std::memcpy(words, counts.mapped().data(), sizeof words);
    const double traced = settings.px_per_ray > 2
                              ? double{1} * coarse.few_rays.x * coarse.few_rays.y * eyes
                              : uint64_t{words[3]} + words[4]; // listed, and every second
    stats.traced_share = traced / (static_cast<double>(scene.size_px.x) * scene.size_px.y * eyes);
    return stats;
}

Result<FrameStats> Renderer::refine(const Scene& scene, const SceneData& data, uint32_t first_row,
                                    uint32_t rows) {
    return or_from_nothing([&] { return refine_rows(scene, data, first_row, rows); });
}

Result<FrameStats> Renderer::refine_rows(const Scene& asked, const SceneData& data,
                                         uint32_t first_row, uint32_t rows) {
    PALPATE_ASSERT(asked.ray_cast.has_value());
    PALPATE_ASSERT_CMP(first_row + rows, <=, tile_rows(asked));
    Scene scene = asked;
    scene.value_and_depth = false;
    FrameStats stats;
    Commands commands(*device_);
    Result<size_t> uploaded = prepare_interactive(scene, data, 1.0, commands);
    if (!uploaded) {
        commands.submit(); // what is recorded is taken for done
        return pass_on(uploaded);
    }
    stats.uploaded_bricks = *uploaded;
    const Timer timer;
    if (!held_->parts.empty())
        stats.uploaded_bricks += show_part(held_->parts.front(), true, commands);
    const uint32_t band = tile_rows_per_submission(*device_, scene, data.volume.grid());
    for (uint32_t row = 0; row < rows; row += band) {
        if (row > 0)
            commands.flush();
        RayPass pass = full_pass(scene);
        // Every tile is marched, also those that see nothing: what lies there is replaced.
        record_tiles(commands, pass, eye_count(scene), gpu::kListAll, first_row + row,
                     std::min(band, rows - row));
        record_ray_cast(commands, pass, scene);
    }
    commands.submit();
    add_times(stats.passes, commands.finish());
    stats.wall_ms = timer.ms();
    tell_residency(stats);
    return stats;
}

} // namespace palpate
