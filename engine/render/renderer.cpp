#include "engine/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/render/frame_block.h"
#include "engine/render/held.h"
#include "shaders/shared/ray_cast.h"
#include "shaders/shared/slices.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

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

RayCastVariant variant_of(const Scene& scene, const Volume& volume) {
    const RayCastLayer& layer = *scene.ray_cast;
    RayCastVariant variant;
    variant.mode = mode_of(layer.mode);
    const bool alpha = layer.mode == RayMode::alpha;
    variant.preintegrated = alpha && layer.integrator == Integrator::preintegrated;
    variant.exact = layer.integrator == Integrator::exact;
    variant.shaded = alpha && layer.shading.has_value();
    variant.labels = scene.labels.has_value();
    variant.slices = !scene.slices.empty() || !scene.surfaces.empty();
    variant.values = scene.value_and_depth;
    variant.no_data = volume.no_data_count() > 0;
    if (layer.mode == RayMode::iso)
        variant.iso_count = static_cast<uint32_t>(layer.isos.size());
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

void add_time(std::vector<PassTime>& sums, const PassTime& time) {
    const auto same = std::find_if(sums.begin(), sums.end(),
                                   [&](const PassTime& p) { return p.name == time.name; });
    if (same != sums.end())
        same->gpu_ms += time.gpu_ms;
    else
        sums.push_back(time);
}

void add_times(std::vector<PassTime>& sums, const std::vector<PassTime>& times) {
    for (const PassTime& time : times)
        add_time(sums, time);
}

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

Renderer::Renderer(GpuDevice& device, RendererOptions options)
    : device_(&device),
      options_(options),
      pipelines_(device),
      linear_(device, Filter::linear, Edge::clamp),
      nearest_(device, Filter::nearest, Edge::clamp),
      label_sampler_(device, Filter::nearest, Edge::border_zero),
      held_(std::make_unique<Held>()) {
    if (options_.memory_limit_bytes == 0)
        options_.memory_limit_bytes = device.info().memory_bytes / 4 * 3;
}

Renderer::~Renderer() = default;

Result<void> Renderer::keep_surfaces(const Scene& scene, const SceneData& data,
                                     Commands& commands) {
    PALPATE_ASSERT_CMP(scene.surfaces.size(), ==, data.meshes.size());
    PALPATE_ASSERT_CMP(scene.surfaces.size(), <=, kMaxSurfaces);
    PALPATE_ASSERT(scene.surface_depth >= 1 && scene.surface_depth <= kMaxSurfaceDepth);
    if (scene.surfaces.empty()) {
        held_->surfaces.reset();
        return {};
    }
    if (!held_->surfaces)
        held_->surfaces.emplace(*device_, nearest_);
    return held_->surfaces->prepare(scene, data, views_of(scene), commands);
}

void Renderer::keep_targets(const Scene& scene) {
    const bool surfaces = !scene.surfaces.empty();
    const bool behind = surfaces || (!scene.slices.empty() && scene.ray_cast.has_value());
    const bool values = scene.value_and_depth || (!scene.slices.empty() && !behind);
    const bool see_through = surfaces && held_->surfaces->has_see_through();
    const uint32_t layers =
        scene.ray_cast && see_through ? scene.surface_depth * eye_count(scene) : 0;
    std::optional<Targets>& held = held_->targets;
    if (held && held->size_px == scene.size_px && held->eyes == eye_count(scene) &&
        held->return_values == scene.value_and_depth && held->values.has_value() == values &&
        held->behind.has_value() == behind &&
        (held->layers ? held->layers->shape().layers : 0) == layers)
        return;
    held.reset();
    held_->tiles.reset();
    held_->slabs.reset();
    held.emplace();
    held->size_px = scene.size_px;
    held->eyes = eye_count(scene);
    held->return_values = scene.value_and_depth;
    const auto make = [&](std::optional<GpuImage>& image, const char* name, VkFormat format) {
        image.emplace(*device_, name,
                      ImageShape{.format = format,
                                 .size = {scene.size_px, 1},
                                 .layers = eye_count(scene),
                                 .storage = true});
    };
    make(held->color, "picture", VK_FORMAT_R32G32B32A32_SFLOAT);
    if (values)
        make(held->values, "value and depth", VK_FORMAT_R32G32_SFLOAT);
    if (behind) {
        make(held->behind, surfaces ? "behind all rays" : "slices", VK_FORMAT_R32G32B32A32_SFLOAT);
        make(held->behind_values,
             surfaces ? "value and depth behind all rays" : "slices' value and depth",
             VK_FORMAT_R32G32_SFLOAT);
    }
    if (layers > 0)
        held->layers.emplace(*device_, "see-through layers",
                             ImageShape{.format = VK_FORMAT_R32G32B32A32_UINT,
                                        .size = {scene.size_px, 1},
                                        .layers = layers,
                                        .storage = true});
}

void Renderer::begin_pipelines(const Scene& scene, const SceneData& data) {
    if (!scene.ray_cast || held_->volume)
        return;
    RayCastVariant variant = variant_of(scene, data.volume);
    variant.skip = options_.skipping;
    variant.atlas = options_.residency == Residency::atlas;
    variant.by_hand = options_.sampling == Sampling::by_hand;
    variant.stored_gradients = options_.stored_gradients && variant.shaded && !variant.by_hand;
    variant.layers = held_->targets->layers ? scene.surface_depth : 0;
    pipelines_.ray_cast(variant);
    pipelines_.tiles(tiles_to_list(scene), false);
    if (takes_slabs(variant))
        pipelines_.mip_slabs();
}

// All that voxels are drawn with.
void Renderer::drop_volumes() {
    held_->volume.reset();
    held_->labels.reset();
    held_->cells.reset();
    held_->gradients.reset();
    held_->tiles.reset();
    held_->slabs.reset();
    held_->tile_groups.reset();
    held_->coarse.reset();
    held_->transfer.reset();
    held_->slice_transfer.reset();
    held_->parts.clear();
    held_->styles.drop();
}

Result<size_t> Renderer::prepare(const Scene& scene, const SceneData& data, Commands& commands) {
    const profile::Scope scope("prepare");
    PALPATE_ASSERT(scene.labels.has_value() == data.labels.has_value());
    if (scene.ray_cast)
        if (Result<void> checked = check_steps(*scene.ray_cast, data.volume.grid()); !checked)
            return pass_on(checked);
    if (Result<void> kept = keep_surfaces(scene, data, commands); !kept)
        return pass_on(kept);
    keep_targets(scene);
    begin_pipelines(scene, data);
    if (!scene.ray_cast && scene.slices.empty()) { // nothing asks for voxels
        drop_volumes();
        return size_t{0};
    }
    Result<size_t> uploaded = keep_volumes(scene, data, commands);
    if (!uploaded)
        return uploaded;
    FrameInputs inputs;
    inputs.value_scale = held_->volume->value_scale();
    inputs.value_bias = held_->volume->value_bias();
    if (data.labels) {
        const auto largest = static_cast<uint32_t>(std::max(0.0f, data.labels->range().max));
        const auto styles = make_label_styles(*scene.labels, largest);
        inputs.style_count = static_cast<uint32_t>(styles.size());
        held_->styles.hold(*device_, "label styles", std::as_bytes(std::span(styles)), commands);
    } else {
        held_->styles.drop();
    }

    const std::vector<View> views = views_of(scene);
    const auto hold_transfer = [&](std::optional<TransferImage>& held, const char* name,
                                   const TransferFunction& function, double step_mm) {
        if (!held)
            held.emplace(*device_, name);
        held->hold(function, step_mm, commands);
        inputs.table_low = held->low();
        inputs.table_high = held->high();
        inputs.table_first = held->first();
        inputs.table_last = held->last();
    };
    if (scene.ray_cast) {
        if (scene.ray_cast->mode == RayMode::iso) // surfaces have colours of their own
            held_->transfer.reset();
        else
            hold_transfer(held_->transfer, "transfer function", scene.ray_cast->transfer,
                          step_mm_of(*scene.ray_cast, data.volume.grid()));
        inputs.cells = held_->cells->count();
        inputs.cell_side = held_->cells->side();
        inputs.cell_margin = held_->cells->margin();
        held_->block = make_frame_block(scene, data, views, inputs);
        held_->frame = commands.upload(bytes_of(held_->block));
        held_->variant = variant_of(scene, data.volume);
        held_->variant.skip =
            options_.skipping && (!takes_slabs(held_->variant) || pays_in_slabs(held_->block));
        held_->variant.count = counting_;
        held_->variant.atlas = held_->volume->is_atlas();
        held_->variant.stored_gradients = held_->gradients.has_value();
        held_->variant.by_hand = options_.sampling == Sampling::by_hand;
        held_->variant.layers = held_->targets->layers ? scene.surface_depth : 0;
    } else {
        held_->tiles.reset();
        held_->slabs.reset();
        held_->tile_groups.reset();
        held_->coarse.reset();
        held_->transfer.reset();
    }
    if (!scene.slices.empty()) {
        hold_transfer(held_->slice_transfer, "slices' transfer function", scene.slice_transfer,
                      1.0);
        held_->slice_frame =
            commands.upload(bytes_of(make_frame_block(scene, data, views, inputs)));
        auto planes = make_slice_planes(scene, data.volume.grid());
        planes.resize(gpu::kMaxSlices);
        held_->planes = commands.upload(std::as_bytes(std::span(planes)));
    } else {
        held_->slice_transfer.reset();
    }
    if (held_->volume->is_atlas())
        if (Result<void> planned = plan_atlas(scene, data); !planned)
            return pass_on(planned);
    return uploaded;
}

Result<size_t> Renderer::prepare_and_wait(const Scene& scene, const SceneData& data,
                                          Commands& commands) {
    const uint64_t before = device_->last_submitted();
    Result<size_t> uploaded = prepare(scene, data, commands);
    if (uploaded && device_->last_submitted() > before)
        finish(commands);
    return uploaded;
}

void Renderer::finish(Commands& commands) {
    commands.flush();
    device_->wait(device_->last_submitted());
}

// Of the frame that was drawn last; the commands that read it back still live.
uint64_t Renderer::read_sample_counts() {
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

uint32_t Renderer::tile_rows(const Scene& scene) {
    return tile_count(scene.size_px).y;
}

uint32_t Renderer::tiles_to_list(const Scene& scene) const {
    // A MIP passes over nothing before it has met something. A cap lies where clip planes cut into
    // values above an iso-value, not where those change.
    const bool capped = scene.ray_cast->mode == RayMode::iso && !scene.clip_planes.empty();
    const bool visible = options_.skipping && scene.ray_cast->mode != RayMode::mip && !capped;
    return visible ? gpu::kListVisible : gpu::kListBox;
}

Buffer* Renderer::slabs(const Scene& scene) {
    if (!takes_slabs(held_->variant)) {
        held_->slabs.reset();
        return nullptr;
    }
    if (!held_->slabs)
        held_->slabs.emplace(*device_, "MIP slabs", slab_bytes(scene), Memory::device);
    return &*held_->slabs;
}

Renderer::RayPass Renderer::full_pass(const Scene& scene) {
    const glm::uvec2 count = tile_count(scene.size_px);
    const size_t most = size_t{count.x} * count.y * eye_count(scene);
    if (!held_->tile_groups)
        held_->tile_groups.emplace(*device_, "tile count", gpu::kTileGroupWords * sizeof(uint32_t),
                                   Memory::device);
    if (!held_->tiles)
        held_->tiles.emplace(*device_, "tiles", most * sizeof(gpu::TileEntry), Memory::device);
    Targets& targets = *held_->targets;
    return {"ray cast",
            held_->variant,
            scene.size_px,
            *held_->frame,
            held_->transfer ? &held_->transfer->image() : nullptr,
            *targets.color,
            targets.values ? &*targets.values : nullptr,
            *held_->tile_groups,
            *held_->tiles,
            slabs(scene)};
}

size_t Renderer::draw_behind(const Scene& scene, const SceneData& data, Commands& commands) {
    size_t uploaded = 0;
    if (!scene.slices.empty()) {
        uploaded = show_part({glm::uvec3(0), data.volume.brick_count(), 3u, held_->sliced}, true,
                             commands);
        record_slices(commands, scene);
    }
    if (!scene.surfaces.empty())
        record_surfaces(commands, scene);
    else if (scene.ray_cast)
        record_background(commands, scene);
    return uploaded;
}

Result<size_t> Renderer::draw_rays(const Scene& scene, const SceneData& data, Commands& commands) {
    const uint32_t rows = tile_rows(scene);
    const uint32_t band = tile_rows_per_submission(*device_, scene, data.volume.grid());
    RayPass pass = full_pass(scene);
    const bool atlas = held_->volume->is_atlas();
    const size_t parts = atlas ? held_->parts.size() : 1;
    size_t uploaded = 0;
    for (size_t part = 0; part < parts; ++part) {
        if (parts > 1) {
            const double share = static_cast<double>(part) / static_cast<double>(parts);
            if (options_.progress && !options_.progress(share))
                return fail("drawing was stopped after {} of {} parts", part, parts);
            commands.flush(); // the device draws one part while the next is read
        }
        if (atlas)
            uploaded += show_part(held_->parts[part], part == 0, commands);
        for (uint32_t row = 0; row < rows; row += band) {
            if (row > 0)
                commands.flush();
            record_tiles(commands, pass, eye_count(scene), tiles_to_list(scene), row,
                         std::min(band, rows - row));
            record_ray_cast(commands, pass, scene);
            if (counting_)
                listed_.push_back(
                    {commands.read_back(*held_->tiles), commands.read_back(*held_->tile_groups)});
        }
    }
    return uploaded;
}

FrameStats FrameTicket::stats() const {
    FrameStats stats = known_;
    const std::vector<PassTime> times = ticket_.times();
    for (size_t i = first_; i < last_; ++i)
        add_time(stats.passes, times[i]);
    return stats;
}

void Renderer::begin_frame(const Commands& commands) {
    while (in_flight_.size() >= std::max<size_t>(1, options_.frames_in_flight)) {
        in_flight_.front().wait();
        in_flight_.pop_front();
    }
    in_flight_.push_back(commands.ticket());
}

Result<RecordedFrame> Renderer::record(Commands& commands, const Scene& scene,
                                       const SceneData& data) {
    return or_from_nothing([&] { return record_frame(commands, scene, data); });
}

Result<RecordedFrame> Renderer::record_frame(Commands& commands, const Scene& scene,
                                             const SceneData& data) {
    const profile::Scope scope("record a frame");
    begin_frame(commands);
    const size_t first = commands.pass_count();
    Result<size_t> uploaded = prepare(scene, data, commands);
    if (!uploaded)
        return pass_on(uploaded);
    Result<FrameStats> known = record_passes(commands, scene, data, *uploaded);
    if (!known)
        return pass_on(known);
    Targets& targets = *held_->targets;
    return RecordedFrame{
        &*targets.color, targets.return_values ? &*targets.values : nullptr,
        FrameTicket(commands.ticket(), std::move(*known), first, commands.pass_count())};
}

Result<FrameStats> Renderer::record_passes(Commands& commands, const Scene& scene,
                                           const SceneData& data, size_t uploaded) {
    PALPATE_ASSERT(scene.ray_cast || !scene.slices.empty() || !scene.surfaces.empty());
    FrameStats stats;
    stats.uploaded_bricks = uploaded;
    if (scene.ray_cast) {
        stats.cell_map_ms = held_->cell_map_ms;
        stats.gradients_ms = held_->gradients_ms;
    }
    stats.uploaded_bricks += draw_behind(scene, data, commands);
    Result<size_t> more = scene.ray_cast ? draw_rays(scene, data, commands) : size_t{0};
    if (!more)
        return pass_on(more);
    stats.uploaded_bricks += *more;
    tell_residency(stats);
    return stats;
}

Result<FrameStats> Renderer::draw(const Scene& scene, const SceneData& data) {
    return or_from_nothing([&] { return draw_frame(scene, data); });
}

Result<FrameStats> Renderer::draw_frame(const Scene& scene, const SceneData& data) {
    profile::Scope frame("frame");
    listed_.clear();
    Commands commands(*device_);
    begin_frame(commands);
    Result<size_t> uploaded = prepare_and_wait(scene, data, commands);
    const Timer timer;
    Result<FrameStats> stats = FrameStats{};
    if (uploaded)
        stats = record_passes(commands, scene, data, *uploaded);
    else
        stats = pass_on(uploaded);
    commands.submit(); // also of a frame that failed: images are as tracked
    if (!stats)
        return stats;
    add_times(stats->passes, commands.finish());
    stats->wall_ms = timer.ms();
    samples_ = read_sample_counts();
    if (frame.recorded())
        frame.tell("wall_ms", Json::of(stats->wall_ms));
    return stats;
}

Result<uint64_t> Renderer::count_samples(const Scene& scene, const SceneData& data) {
    const Restored counting(counting_, true);
    Result<FrameStats> drawn = draw(scene, data);
    if (!drawn)
        return pass_on(drawn);
    return samples_;
}

std::vector<Image> Renderer::read_back() {
    const profile::Scope scope("read back");
    PALPATE_ASSERT(held_->targets.has_value());
    Targets& targets = *held_->targets;
    const size_t pixels = size_t{targets.size_px.x} * targets.size_px.y;
    Commands commands(*device_);
    const auto fetch = [&](GpuImage& image, size_t channels) {
        const Commands::Region region{.buffer_offset = 0,
                                      .image_offset = {},
                                      .size = {targets.size_px, 1},
                                      .layers = targets.eyes};
        const BufferSlice bytes = commands.read_back(
            image, std::span(&region, 1), pixels * targets.eyes * channels * sizeof(float));
        return reinterpret_cast<const float*>(bytes.mapped().data());
    };
    const float* const color = fetch(*targets.color, 4);
    const float* const values = targets.return_values ? fetch(*targets.values, 2) : nullptr;
    commands.submit();
    commands.finish();
    std::vector<std::string> channels{"R", "G", "B", "A"};
    if (targets.return_values)
        channels.insert(channels.end(), {"value", "depth"});
    std::vector<Image> eyes;
    for (uint32_t eye = 0; eye < targets.eyes; ++eye) {
        Image image = make_image(targets.size_px, channels);
        for (size_t p = 0; p < pixels; ++p) {
            float* out = &image.samples[p * channels.size()];
            std::copy_n(&color[(eye * pixels + p) * 4], 4, out);
            if (targets.return_values)
                std::copy_n(&values[(eye * pixels + p) * 2], 2, out + 4);
        }
        eyes.push_back(std::move(image));
    }
    return eyes;
}

Result<Frame> Renderer::render(const Scene& scene, const SceneData& data) {
    Result<FrameStats> stats = draw(scene, data);
    if (!stats)
        return pass_on(stats);
    return Frame{read_back(), std::move(*stats)};
}

} // namespace palpate
