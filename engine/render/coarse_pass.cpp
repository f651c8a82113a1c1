#include "engine/render/coarse_pass.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "shaders/shared/interactive.h"
#include "shaders/shared/tiles.h"
#include "spirv/enlarge.h"
#include "spirv/interpolate.h"
#include "spirv/judge.h"

namespace palpate {

namespace {

// `block` for rays through other pixels: one in px_per_ray both ways.
gpu::Frame sparser(gpu::Frame block, glm::uvec2 rays, glm::uvec2 first_px, uint32_t px_per_ray) {
    block.rays = rays;
    block.first_px = glm::vec2(first_px);
    block.px_per_ray = static_cast<float>(px_per_ray);
    for (gpu::FrameEye& eye : block.eyes)
        eye.spread *= block.px_per_ray; // a tile covers more pixels
    return block;
}

// The largest number of the sparse rays.
glm::uvec2 probes_of(glm::uvec2 size_px) {
    return (size_px + (kJudgedSpacing_px - 1)) / kJudgedSpacing_px;
}

size_t area(glm::uvec2 size) {
    return size_t{size.x} * size.y;
}

ImageShape shape_of(glm::uvec2 size, uint32_t eyes) {
    return {.format = VK_FORMAT_R32G32B32A32_SFLOAT,
            .size = {size, 1},
            .layers = eyes,
            .storage = true};
}

} // namespace

double default_contrast(RayMode mode) {
    return mode == RayMode::iso ? 0.115 : 0.06;
}

CoarsePass::CoarsePass(RenderStore& store, const Scene& scene)
    : store_(&store),
      size_px_(scene.size_px),
      eyes_(eye_count(scene)),
      truth_(store.device, "sparse pixels", shape_of(probes_of(size_px_), eyes_)),
      few_(store.device, "few pixels", shape_of((size_px_ + 3u) / 4u, eyes_)),
      spans_(store.device, "tiles' spans", area(tile_count(size_px_)) * eyes_ * sizeof(glm::vec2),
             Memory::device),
      tile_groups_(store.device, "sparse tile count", gpu::kTileGroupWords * sizeof(uint32_t),
                   Memory::device),
      tiles_(store.device, "sparse tiles",
             area(tile_count(probes_of(size_px_))) * eyes_ * sizeof(gpu::TileEntry),
             Memory::device),
      ray_groups_(store.device, "listed ray count", gpu::kRayGroupWords * sizeof(uint32_t),
                  Memory::device),
      rays_listed_(store.device, "listed rays", area(size_px_) * eyes_ * sizeof(uint32_t),
                   Memory::device),
      first_hits_(store.device, "first hits", area((size_px_ + 1u) / 2u) * eyes_ * sizeof(float),
                  Memory::device),
      squares_(store.device, "squared errors", area(probes_of(size_px_)) * eyes_ * sizeof(float),
               Memory::device) {}

bool CoarsePass::suits(const Scene& scene) const {
    return size_px_ == scene.size_px && eyes_ == eye_count(scene);
}

double CoarsePass::step_factor(const RayCastLayer& layer, const CoarseSettings& settings) {
    return layer.integrator != Integrator::exact ? std::max(1.0, settings.step_factor) : 1.0;
}

CoarseRays CoarsePass::record(const ViewFrame& frame, RayCastPass& pass,
                              const CoarseSettings& settings) {
    const Scene& scene = frame.scene;
    const RayCastLayer& layer = *scene.ray_cast;
    Commands& commands = frame.commands;
    // The step of the rays between the sparse ones of full quality.
    const double factor = step_factor(layer, settings);
    const double step_mm = step_mm_of(layer, frame.data.volume.grid()) * factor;
    const Rays full = pass.all_rays(frame);
    if (factor != 1.0 && full.table)
        store_->take_table(table_, layer.transfer, step_mm, commands);
    else
        store_->transfers.drop(table_);
    gpu::Frame block = pass.block();
    block.step = static_cast<float>(step_mm);

    commands.clear(truth_, glm::vec4(glm::vec3(scene.background), 0.0f));
    Rays second = full;
    second.name = "every second pixel";
    second.block = commands.upload(bytes_of(block));
    second.table = table_ ? &table_->image() : full.table;
    second.spans = &spans_;
    second.first_hits = &first_hits_;
    second.variant.rays = gpu::kRaysEverySecond;
    if (second.variant.has_first_hits())
        commands.zero(first_hits_); // empty tiles have no rays, and leave none
    // Behind the volume there may be slices, and beside it meshes.
    const uint32_t which = !scene.surfaces.empty() ? gpu::kListAll
                           : !scene.slices.empty() ? gpu::kListBox
                                                   : pass.tiles_to_list(scene);
    const bool few = settings.px_per_ray > 2;
    if (few)
        record_few(frame, pass, second, block, which, settings.px_per_ray);
    else
        record_every_second(frame, pass, second, which,
                            settings.contrast.value_or(default_contrast(layer.mode)));
    CoarseRays rays = record_judgement(frame, pass, full);
    const glm::uvec2 apart = (size_px_ + (settings.px_per_ray - 1)) / settings.px_per_ray;
    if (few)
        rays.traced = area(apart) * eyes_;
    return rays;
}

void CoarsePass::record_every_second(const ViewFrame& frame, RayCastPass& pass, const Rays& second,
                                     uint32_t which, double contrast) {
    Commands& commands = frame.commands;
    const glm::uvec2 tiles = tile_count(size_px_);
    if (pass.cast_tiles(frame, second, which, RayCastPass::all_tiles(size_px_)))
        commands.flush(); // the listed pixels are few but where neighbours differ
    constexpr uint32_t none[gpu::kRayGroupWords] = {0, 1, 1, 0, 0};
    const gpu::InterpolateBlock block{size_px_, static_cast<float>(contrast)};
    commands.begin_pass("interpolate");
    commands.fill(ray_groups_, none);
    const Bound bound[] = {bind_uniform(gpu::kInterpolateBlock, commands.upload(bytes_of(block))),
                           bind_storage_image(gpu::kInterpolateColor, *frame.targets.color),
                           bind_storage(gpu::kInterpolateSpans, spans_),
                           bind_storage(gpu::kInterpolateGroups, ray_groups_, Use::storage_write),
                           bind_storage(gpu::kInterpolateRays, rays_listed_, Use::storage_write)};
    commands.dispatch(store_->pipelines.get(spirv::Interpolate{}), bound,
                      {(tiles.x + 3) / 4, tiles.y, eyes_});
    commands.end_pass();
    Rays listed = second;
    listed.name = "listed pixels";
    listed.variant.rays = gpu::kRaysListed;
    listed.groups = &ray_groups_;
    listed.list = &rays_listed_;
    pass.cast(frame, listed);
}

// In place of `second`, whose tiles tell where to look, and of the listed pixels.
void CoarsePass::record_few(const ViewFrame& frame, RayCastPass& pass, const Rays& second,
                            const gpu::Frame& block, uint32_t which, uint32_t px_per_ray) {
    Commands& commands = frame.commands;
    const Scene& scene = frame.scene;
    const glm::uvec2 count = (size_px_ + (px_per_ray - 1)) / px_per_ray;
    const glm::uvec2 first_px = (size_px_ - 1u - px_per_ray * (count - 1u)) / 2u;
    pass.list_tiles(frame, second, which, RayCastPass::all_tiles(size_px_));
    commands.clear(few_, glm::vec4(glm::vec3(scene.background), 0.0f));
    Rays few = second;
    few.name = "few pixels";
    few.count = count;
    few.block = commands.upload(bytes_of(sparser(block, count, first_px, px_per_ray)));
    few.color = &few_;
    cast_sparse(frame, pass, few);
    const gpu::EnlargeBlock enlarge{size_px_, count, first_px, px_per_ray};
    const Bound bound[] = {bind_uniform(gpu::kEnlargeBlock, commands.upload(bytes_of(enlarge))),
                           bind_sampled(gpu::kEnlargeFew, few_, store_->nearest),
                           bind_storage_image(gpu::kEnlargeColor, *frame.targets.color),
                           bind_storage(gpu::kEnlargeSpans, spans_)};
    commands.begin_pass("enlarge");
    commands.dispatch(store_->pipelines.get(spirv::Enlarge{}), bound,
                      {(count.x + gpu::kEnlargeGroup) / gpu::kEnlargeGroup,
                       (size_px_.y + gpu::kEnlargeGroup - 1) / gpu::kEnlargeGroup, eyes_});
    commands.end_pass();
}

// Rays apart from each other, in tiles of their own; they use the spans and slabs of the picture's.
void CoarsePass::cast_sparse(const ViewFrame& frame, RayCastPass& pass, Rays rays) {
    Buffer* const slabs = std::exchange(rays.slabs, nullptr);
    rays.spans = rays.first_hits = nullptr;
    rays.variant.rays = gpu::kRaysSparse;
    pass.list_tiles(frame, rays, frame.scene.surfaces.empty() ? gpu::kListBox : gpu::kListAll,
                    RayCastPass::all_tiles(rays.count));
    rays.slabs = slabs;
    rays.spans = &spans_;
    pass.cast(frame, rays);
}

CoarseRays CoarsePass::record_judgement(const ViewFrame& frame, RayCastPass& pass,
                                        const Rays& full) {
    Commands& commands = frame.commands;
    // 4 and 7 have no factor in common with the spacing: other places come by in turn.
    const glm::uvec2 place(4 * drawn_ % kJudgedSpacing_px, 7 * drawn_ % kJudgedSpacing_px);
    ++drawn_;
    const glm::uvec2 first = glm::min(place, size_px_ - 1u);
    const glm::uvec2 count = (size_px_ - first + (kJudgedSpacing_px - 1)) / kJudgedSpacing_px;
    Rays sparse = full;
    sparse.name = "sparse pixels";
    sparse.is_picture = false;
    sparse.count = count;
    sparse.block =
        commands.upload(bytes_of(sparser(pass.block(), count, first, kJudgedSpacing_px)));
    sparse.color = &truth_;
    sparse.groups = &tile_groups_;
    sparse.list = &tiles_;
    if (RayCastPass::takes_slabs(sparse.variant) && table_) // slabs count in steps
        sparse.variant.skip = false;
    cast_sparse(frame, pass, sparse);
    const gpu::JudgeBlock judge{count, first, kJudgedSpacing_px};
    const Bound bound[] = {bind_uniform(gpu::kJudgeBlock, commands.upload(bytes_of(judge))),
                           bind_sampled(gpu::kJudgeColor, *frame.targets.color, store_->nearest),
                           bind_sampled(gpu::kJudgeTruth, truth_, store_->nearest),
                           bind_storage(gpu::kJudgeSquares, squares_, Use::storage_write)};
    commands.begin_pass("judge");
    commands.dispatch(store_->pipelines.get(spirv::Judge{}), bound,
                      {(count.x + 63) / 64, count.y, eyes_});
    commands.end_pass();
    return {commands.read_back(ray_groups_),
            commands.read_back(squares_),
            area(count) * eyes_,
            first,
            std::nullopt,
            area(size_px_) * eyes_};
}

CoarseStats CoarseRays::stats() const {
    CoarseStats stats;
    std::vector<float> errors(judged);
    std::memcpy(errors.data(), squares.mapped().data(), errors.size() * sizeof(float));
    double sum = 0;
    for (const float square : errors)
        sum += square;
    stats.error_estimate = std::sqrt(sum / static_cast<double>(errors.size()));
    stats.first_judged = first_judged;
    uint32_t words[gpu::kRayGroupWords];
    std::memcpy(words, counts.mapped().data(), sizeof words);
    const uint64_t listed = uint64_t{words[3]} + words[4]; // and those of every second pixel
    stats.traced_share = static_cast<double>(traced.value_or(listed)) / static_cast<double>(pixels);
    return stats;
}

} // namespace palpate
