#include "engine/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/render/frame_block.h"
#include "engine/render/transfer_image.h"
#include "engine/render/volume_parts.h"
#include "engine/volume/changes.h"
#include "shaders/shared/ray_cast.h"
#include "shaders/shared/slices.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// A submission on a device with a watchdog takes at most about this many samples: 50 ms at 2e10
// samples a second, a tenth of what a large GPU reaches.
constexpr double kSamplesPerSubmission = 1e9;

uint32_t eye_count(const Scene& scene) {
    return scene.stereo ? 2 : 1;
}

glm::uvec2 tile_count(const Scene& scene) {
    return (scene.size_px + (gpu::kTileSide - 1)) / gpu::kTileSide;
}

// Rows of tiles that one submission marches: as many as a dispatch has workgroups for, and on a
// device with a watchdog no more than take a moment.
uint32_t tile_rows_per_submission(const Device& device, const Scene& scene, const Grid& grid) {
    const glm::uvec2 count = tile_count(scene);
    const uint32_t tiles_per_row = count.x * eye_count(scene);
    const uint32_t most = std::max(1u, device.limits().maxComputeWorkGroupCount[0] / tiles_per_row);
    const uint32_t rows = std::min(count.y, most);
    if (device.info().is_cpu() || !scene.ray_cast)
        return rows;
    const glm::dvec3 extent_mm = spacing_mm(grid) * glm::dvec3(grid.size);
    const double per_ray = glm::length(extent_mm) / step_mm_of(*scene.ray_cast, grid);
    const double per_row = per_ray * scene.size_px.x * gpu::kTileSide * eye_count(scene);
    return std::clamp(static_cast<uint32_t>(kSamplesPerSubmission / per_row), 1u, rows);
}

std::vector<View> views_of(const Scene& scene) {
    if (!scene.stereo)
        return {make_view(scene.camera, scene.size_px)};
    const auto pair = make_stereo_views(scene.camera, scene.stereo->rig, scene.size_px);
    return {pair.begin(), pair.end()};
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

RayCastVariant variant_of(const Scene& scene, const Volume& volume) {
    const RayCastLayer& layer = *scene.ray_cast;
    RayCastVariant variant;
    variant.mode = mode_of(layer.mode);
    const bool alpha = layer.mode == RayMode::alpha;
    variant.preintegrated = alpha && layer.integrator == Integrator::preintegrated;
    variant.exact = layer.integrator == Integrator::exact;
    variant.shaded = alpha && layer.shading.has_value();
    variant.labels = scene.labels.has_value();
    variant.slices = !scene.slices.empty();
    variant.values = scene.value_and_depth;
    variant.no_data = volume.no_data_count() > 0;
    if (layer.mode == RayMode::iso)
        variant.iso_count = static_cast<uint32_t>(layer.isos.size());
    return variant;
}

// Keeps a small buffer in step with its contents: written only when they differ.
class MirroredBuffer {
 public:
    void hold(Device& device, const char* name, std::span<const std::byte> bytes) {
        if (buffer_ && bytes.size() == buffer_->bytes() &&
            std::memcmp(bytes.data(), buffer_->mapped().data(), bytes.size()) == 0)
            return;
        buffer_.emplace(device, name, bytes.size(), Memory::upload); // the old one is retired
        std::memcpy(buffer_->mapped().data(), bytes.data(), bytes.size());
    }
    void drop() { buffer_.reset(); }
    Buffer& get() { return *buffer_; }

 private:
    std::optional<Buffer> buffer_;
};

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

template <class T>
std::span<const std::byte> bytes_of(const T& value) {
    return std::as_bytes(std::span(&value, 1));
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

struct Renderer::Targets {
    glm::uvec2 size_px;
    uint32_t eyes;
    bool return_values;                            // the scene asks for value and depth
    std::optional<GpuImage> color, values;         // what is read back
    std::optional<GpuImage> behind, behind_values; // slices that a ray caster draws over
    std::optional<GpuImage> carry;                 // what rays bring from part to part of an atlas
};

struct Renderer::Held {
    std::optional<GpuVolume> volume, labels;
    std::optional<CellMap> cells;
    std::optional<Buffer> tile_groups, tiles;
    double cell_map_ms = 0;
    std::optional<TransferImage> transfer, slice_transfer;
    MirroredBuffer frame, slice_frame, planes, styles;
    std::optional<Targets> targets;
    RayCastVariant variant;
    // Of a volume in an atlas:
    BrickMask seen;                 // by the ray caster
    std::vector<glm::uvec3> sliced; // bricks that slices run through
    size_t needed_bricks = 0;
    std::vector<Part> parts;
    MirroredBuffer atlas_frame;
};

Renderer::Renderer(Device& device, RendererOptions options)
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

Result<size_t> Renderer::keep_volume(std::optional<GpuVolume>& held, const char* name,
                                     const Volume& volume, const GpuVolumeWish& wish,
                                     std::span<const ChangedBrick> changed) {
    if (held && held->suits(volume, wish)) {
        if (volume.is_same_as(held->snapshot()))
            return size_t{0};
        held->update(volume, changed);
        return held->is_atlas() ? 0 : changed.size();
    }
    held.reset();
    Result<GpuVolume> made = GpuVolume::make(*device_, name, volume, wish);
    if (!made)
        return pass_on(made);
    held.emplace(std::move(*made));
    const glm::uvec3 bricks = volume.brick_count();
    return held->is_atlas() ? 0 : size_t{bricks.x} * bricks.y * bricks.z;
}

// What is left of the limit beside all that is on the device, `apart` excepted.
uint64_t Renderer::free_bytes(std::optional<GpuVolume>& apart) const {
    uint64_t used = 0;
    for (const ResourceInfo& resource : device_->resources())
        used += resource.bytes;
    if (apart)
        used -= apart->bytes();
    return options_.memory_limit_bytes - std::min(options_.memory_limit_bytes, used);
}

Result<size_t> Renderer::keep_volumes(const Scene& scene, const SceneData& data) {
    const auto same_kind = [](const std::optional<GpuVolume>& held, const Volume& next) {
        return held && held->snapshot().size() == next.size() &&
               held->snapshot().type() == next.type();
    };
    const auto changed_since = [&](const std::optional<GpuVolume>& held, const Volume& next) {
        return same_kind(held, next) && !next.is_same_as(held->snapshot())
                   ? changed_bricks(held->snapshot(), next)
                   : std::vector<ChangedBrick>{};
    };
    size_t uploaded = 0;
    if (data.labels) {
        const Result<size_t> more =
            keep_volume(held_->labels, "labels", *data.labels,
                        {.format = TexelFormat::label, .limit_bytes = free_bytes(held_->labels)},
                        changed_since(held_->labels, *data.labels));
        if (!more)
            return more;
        uploaded = *more;
    } else {
        held_->labels.reset();
    }
    const std::vector<ChangedBrick> changed = changed_since(held_->volume, data.volume);
    if (!scene.ray_cast || !same_kind(held_->volume, data.volume))
        held_->cells.reset();
    else if (held_->cells && !data.volume.is_same_as(held_->volume->snapshot()))
        held_->cells->update(data.volume, changed);
    const Timer timer;
    if (scene.ray_cast && !held_->cells)
        held_->cells.emplace(*device_, data.volume);
    if (scene.ray_cast && scene.ray_cast->mode != RayMode::mip)
        held_->cells->show(*scene.ray_cast, 1.0f, 0.0f); // distances alone
    held_->cell_map_ms = timer.ms();

    find_needed_bricks(scene, data.volume);
    const Result<size_t> more = keep_volume(held_->volume, "volume", data.volume,
                                            {.format = options_.volume_format,
                                             .residency = options_.residency,
                                             .limit_bytes = room_for_volume(scene),
                                             .needed_bricks = held_->needed_bricks,
                                             .most_bricks = options_.most_resident_bricks},
                                            changed);
    if (!more)
        return more;
    if (scene.ray_cast) {
        const Timer again;
        held_->cells->show(*scene.ray_cast, held_->volume->value_scale(),
                           held_->volume->value_bias());
        held_->cell_map_ms += again.ms();
    }
    return uploaded + *more;
}

// What the volume may take: some is kept for what is made after it.
uint64_t Renderer::room_for_volume(const Scene& scene) {
    uint64_t kept = 1 << 20; // tables, uniforms, lists of tiles
    if (scene.ray_cast)      // macro-cells of a MIP with their staging, and what rays carry
        kept += 8 * held_->cells->cell_count() + (held_->targets->carry ? 0 : carry_bytes(scene));
    const uint64_t free = free_bytes(held_->volume);
    return free - std::min(free, kept);
}

void Renderer::find_needed_bricks(const Scene& scene, const Volume& volume) {
    held_->seen.clear();
    held_->sliced.clear();
    held_->parts.clear();
    held_->needed_bricks = 0;
    const uint64_t most_bytes = sample_count(volume.grid()) * sizeof(float);
    if (options_.residency == Residency::dense ||
        (options_.residency == Residency::automatic &&
         most_bytes <= free_bytes(held_->volume) / 2)) // dense, whatever can be seen
        return;
    if (scene.ray_cast)
        held_->seen = bricks_for_rays(*scene.ray_cast, volume, *held_->cells);
    if (!scene.slices.empty())
        held_->sliced = bricks_for_slices(scene, volume);
    held_->needed_bricks =
        std::max(static_cast<size_t>(std::count(held_->seen.begin(), held_->seen.end(), 1)),
                 held_->sliced.size());
}

Result<void> Renderer::plan_atlas(const Scene& scene, const SceneData& data) {
    const size_t room = held_->volume->atlas().capacity();
    if (held_->sliced.size() > room)
        return fail("the volume: its slices run through {} bricks, and the device has room for {}",
                    held_->sliced.size(), room);
    if (!scene.ray_cast)
        return {};
    std::vector<Viewpoint> viewpoints;
    for (const View& view : views_of(scene))
        viewpoints.push_back(viewpoint_of(view, data.volume.grid()));
    Result<std::vector<Part>> parts =
        plan_parts(data.volume.brick_count(), held_->seen, room,
                   reach_samples(*scene.ray_cast, data.volume.grid()), viewpoints);
    if (!parts)
        return pass_on(parts);
    held_->parts = std::move(*parts);
    if (!held_->targets->carry)
        held_->targets->carry.emplace(*device_, "carried by rays", carry_shape(scene));
    return {};
}

void Renderer::keep_targets(const Scene& scene) {
    const bool slices_behind = !scene.slices.empty() && scene.ray_cast.has_value();
    const bool values = scene.value_and_depth || (!scene.slices.empty() && !scene.ray_cast);
    std::optional<Targets>& held = held_->targets;
    if (held && held->size_px == scene.size_px && held->eyes == eye_count(scene) &&
        held->return_values == scene.value_and_depth && held->values.has_value() == values &&
        held->behind.has_value() == slices_behind)
        return;
    held.reset();
    held_->tiles.reset();
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
    if (slices_behind) {
        make(held->behind, "slices", VK_FORMAT_R32G32B32A32_SFLOAT);
        make(held->behind_values, "slices' value and depth", VK_FORMAT_R32G32_SFLOAT);
    }
}

Result<size_t> Renderer::prepare(const Scene& scene, const SceneData& data) {
    const profile::Scope scope("prepare");
    PALPATE_ASSERT(scene.labels.has_value() == data.labels.has_value());
    keep_targets(scene);
    Result<size_t> uploaded = keep_volumes(scene, data);
    if (!uploaded)
        return uploaded;
    FrameInputs inputs;
    inputs.value_scale = held_->volume->value_scale();
    inputs.value_bias = held_->volume->value_bias();
    if (data.labels) {
        const auto largest = static_cast<uint32_t>(std::max(0.0f, data.labels->range().max));
        const auto styles = make_label_styles(*scene.labels, largest);
        inputs.style_count = static_cast<uint32_t>(styles.size());
        held_->styles.hold(*device_, "label styles", std::as_bytes(std::span(styles)));
    } else {
        held_->styles.drop();
    }

    const std::vector<View> views = views_of(scene);
    const auto hold_transfer = [&](std::optional<TransferImage>& held, const char* name,
                                   const TransferFunction& function, double step_mm) {
        if (!held || held->function() != function || held->step_mm() != step_mm)
            held.emplace(*device_, name, function, step_mm);
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
        held_->frame.hold(*device_, "ray cast",
                          bytes_of(make_frame_block(scene, data, views, inputs)));
        held_->variant = variant_of(scene, data.volume);
        held_->variant.skip = options_.skipping && held_->cells->pays(scene.ray_cast->mode);
        held_->variant.count = counting_;
        held_->variant.atlas = held_->volume->is_atlas();
        held_->variant.by_hand = options_.sampling == Sampling::by_hand;
    } else {
        held_->tiles.reset();
        held_->tile_groups.reset();
        held_->transfer.reset();
        held_->frame.drop();
    }
    if (!scene.slices.empty()) {
        hold_transfer(held_->slice_transfer, "slices' transfer function", scene.slice_transfer,
                      1.0);
        held_->slice_frame.hold(*device_, "slices",
                                bytes_of(make_frame_block(scene, data, views, inputs)));
        auto planes = make_slice_planes(scene, data.volume.grid());
        planes.resize(gpu::kMaxSlices);
        held_->planes.hold(*device_, "slice planes", std::as_bytes(std::span(planes)));
    } else {
        held_->slice_transfer.reset();
        held_->slice_frame.drop();
        held_->planes.drop();
    }
    if (held_->volume->is_atlas())
        if (const Result<void> planned = plan_atlas(scene, data); !planned)
            return tl::unexpected(planned.error());
    return uploaded;
}

void Renderer::bind_atlas(std::vector<Bound>& bound, uint32_t pages, uint32_t frame) {
    if (!held_->volume->is_atlas())
        return;
    bound.push_back(bind_sampled(pages, held_->volume->atlas().table(), nearest_));
    bound.push_back(bind_uniform(frame, held_->atlas_frame.get()));
}

void Renderer::show_part(const Part& part, bool first) {
    BrickAtlas& atlas = held_->volume->atlas();
    held_->atlas_frame.hold(
        *device_, "atlas frame",
        bytes_of(make_atlas_frame(atlas, held_->volume->snapshot(), part, first)));
}

void Renderer::record_slices(Commands& commands, const Scene& scene) {
    Targets& targets = *held_->targets;
    std::vector<Bound> bound{
        bind_uniform(gpu::kSliceFrame, held_->slice_frame.get()),
        bind_sampled(gpu::kSliceVolume, held_->volume->image(), linear_),
        bind_sampled(gpu::kSliceTable, held_->slice_transfer->image(), nearest_)};
    if (scene.labels) {
        bound.push_back(bind_sampled(gpu::kSliceLabels, held_->labels->image(), label_sampler_));
        bound.push_back(bind_storage(gpu::kSliceStyles, held_->styles.get()));
    }
    bound.push_back(bind_uniform(gpu::kSlicePlanes, held_->planes.get()));
    const bool behind = targets.behind.has_value();
    bound.push_back(
        bind_storage_image(gpu::kSliceColor, behind ? *targets.behind : *targets.color));
    bound.push_back(
        bind_storage_image(gpu::kSliceValues, behind ? *targets.behind_values : *targets.values));
    bind_atlas(bound, gpu::kSlicePages, gpu::kSliceAtlas);
    commands.begin_pass("slices");
    commands.dispatch(pipelines_.slices(scene.labels.has_value(), held_->volume->is_atlas(),
                                        options_.sampling == Sampling::by_hand),
                      bound, {tile_count(scene), eye_count(scene)});
    commands.end_pass();
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

void Renderer::record_tiles(Commands& commands, const Scene& scene, uint32_t first_row,
                            uint32_t rows) {
    const glm::uvec2 count = tile_count(scene);
    const size_t most = size_t{count.x} * count.y * eye_count(scene);
    if (!held_->tile_groups)
        held_->tile_groups.emplace(*device_, "tile count", 3 * sizeof(uint32_t), Memory::device);
    if (!held_->tiles)
        held_->tiles.emplace(*device_, "tiles", most * sizeof(gpu::TileEntry), Memory::device);
    // A MIP passes over nothing before it has met something.
    // A cap lies where clip planes cut into values above an iso-value, not where those change.
    const bool capped = scene.ray_cast->mode == RayMode::iso && !scene.clip_planes.empty();
    const bool skip = options_.skipping && scene.ray_cast->mode != RayMode::mip && !capped;
    const uint32_t none[] = {0, 1, 1};
    commands.begin_pass("tiles");
    commands.fill(*held_->tile_groups, none);
    const Bound bound[] = {bind_uniform(gpu::kTileFrame, held_->frame.get()),
                           bind_sampled(gpu::kTileCells, held_->cells->image(), nearest_),
                           bind_storage(gpu::kTileGroups, *held_->tile_groups, Use::storage_write),
                           bind_storage(gpu::kTileEntries, *held_->tiles, Use::storage_write)};
    commands.dispatch(pipelines_.tiles(skip), bound, {(count.x + 63) / 64, rows, eye_count(scene)},
                      {0, first_row, 0});
    commands.end_pass();
}

void Renderer::record_ray_cast(Commands& commands, const Scene& scene) {
    Targets& targets = *held_->targets;
    std::vector<Bound> bound{bind_uniform(gpu::kRayFrame, held_->frame.get()),
                             bind_sampled(gpu::kRayVolume, held_->volume->image(), linear_)};
    if (held_->transfer)
        bound.push_back(bind_sampled(gpu::kRayTable, held_->transfer->image(), nearest_));
    if (held_->variant.exact) {
        bound.push_back(bind_sampled(gpu::kRayCorners, held_->volume->image(), nearest_));
        if (held_->transfer)
            bound.push_back(bind_sampled(gpu::kRaySmoothTable, held_->transfer->image(), linear_));
    }
    if (scene.labels) {
        bound.push_back(bind_sampled(gpu::kRayLabels, held_->labels->image(), label_sampler_));
        bound.push_back(bind_storage(gpu::kRayStyles, held_->styles.get()));
    }
    if (!scene.slices.empty()) {
        bound.push_back(bind_sampled(gpu::kRayBehind, *targets.behind, nearest_));
        bound.push_back(bind_sampled(gpu::kRayBehindValues, *targets.behind_values, nearest_));
    }
    bound.push_back(bind_storage_image(gpu::kRayColor, *targets.color));
    if (scene.value_and_depth)
        bound.push_back(bind_storage_image(gpu::kRayValues, *targets.values));
    bound.push_back(bind_sampled(gpu::kRayCells, held_->cells->image(), nearest_));
    bound.push_back(bind_storage(gpu::kRayTiles, *held_->tiles,
                                 held_->variant.count ? Use::storage_write : Use::storage_read));
    bound.push_back(bind_storage(gpu::kRayTileGroups, *held_->tile_groups));
    bind_atlas(bound, gpu::kRayPages, gpu::kRayAtlas);
    if (held_->volume->is_atlas())
        bound.push_back(bind_storage_image(gpu::kRayCarry, *targets.carry));
    commands.begin_pass("ray cast");
    commands.dispatch_indirect(pipelines_.ray_cast(held_->variant), bound, *held_->tile_groups);
    commands.end_pass();
}

uint64_t Renderer::read_sample_count() {
    Buffer copy(*device_, "tiles read back", held_->tiles->bytes(), Memory::read_back);
    Buffer groups(*device_, "tile count read back", held_->tile_groups->bytes(), Memory::read_back);
    Commands commands(*device_);
    commands.copy(*held_->tiles, copy);
    commands.copy(*held_->tile_groups, groups);
    commands.submit();
    commands.finish();
    uint32_t count = 0;
    std::memcpy(&count, groups.mapped().data(), sizeof count);
    uint64_t samples = 0;
    for (uint32_t i = 0; i < count; ++i) {
        gpu::TileEntry entry;
        std::memcpy(&entry, copy.mapped().data() + i * sizeof entry, sizeof entry);
        samples += entry.samples;
    }
    return samples;
}

// Records what makes the picture; all but the last submission are on their way. The bricks that
// were uploaded on the way.
Result<size_t> Renderer::draw_all(const Scene& scene, const SceneData& data,
                                  std::deque<Commands>& submissions) {
    const bool atlas = held_->volume->is_atlas();
    size_t uploaded = 0;
    if (!scene.slices.empty()) {
        if (atlas) {
            uploaded += held_->volume->make_resident(held_->sliced);
            show_part({glm::uvec3(0), data.volume.brick_count(), 3u, {}}, true);
        }
        record_slices(submissions.back(), scene);
    }
    if (!scene.ray_cast)
        return uploaded;
    record_background(submissions.back(), scene);
    const auto next_submission = [&] {
        submissions.back().submit();
        submissions.emplace_back(*device_);
    };
    const uint32_t rows = tile_count(scene).y;
    const uint32_t band = tile_rows_per_submission(*device_, scene, data.volume.grid());
    const size_t parts = atlas ? held_->parts.size() : 1;
    for (size_t part = 0; part < parts; ++part) {
        if (atlas) {
            const double share = static_cast<double>(part) / static_cast<double>(parts);
            if (parts > 1 && options_.progress && !options_.progress(share))
                return fail("drawing was stopped after {} of {} parts", part, parts);
            next_submission(); // bricks of the last part may be needed up to here
            uploaded += held_->volume->make_resident(held_->parts[part].bricks);
            show_part(held_->parts[part], part == 0);
        }
        for (uint32_t row = 0; row < rows; row += band) {
            if (row > 0) {
                submissions.back().submit();
                if (counting_)
                    samples_ += read_sample_count();
                submissions.emplace_back(*device_);
            }
            record_tiles(submissions.back(), scene, row, std::min(band, rows - row));
            record_ray_cast(submissions.back(), scene);
        }
        if (counting_ && part + 1 < parts) {
            next_submission();
            samples_ += read_sample_count();
        }
    }
    return uploaded;
}

Result<FrameStats> Renderer::draw(const Scene& scene, const SceneData& data) {
    PALPATE_ASSERT(scene.ray_cast || !scene.slices.empty());
    FrameStats stats;
    profile::Scope frame("frame");
    const Result<size_t> uploaded = prepare(scene, data);
    if (!uploaded)
        return tl::unexpected(uploaded.error());
    stats.uploaded_bricks = *uploaded;
    if (scene.ray_cast)
        stats.cell_map_ms = held_->cell_map_ms;

    const Timer timer;
    std::deque<Commands> submissions;
    submissions.emplace_back(*device_);
    if (const Result<size_t> more = draw_all(scene, data, submissions); !more)
        return tl::unexpected(more.error());
    else
        stats.uploaded_bricks += *more;
    submissions.back().submit();
    if (scene.ray_cast && counting_)
        samples_ += read_sample_count();
    for (Commands& submission : submissions)
        for (PassTime& time : submission.finish()) {
            const auto same = std::find_if(stats.passes.begin(), stats.passes.end(),
                                           [&](const PassTime& p) { return p.name == time.name; });
            if (same != stats.passes.end())
                same->gpu_ms += time.gpu_ms;
            else
                stats.passes.push_back(std::move(time));
        }
    stats.wall_ms = timer.ms();
    stats.atlas = held_->volume->is_atlas();
    stats.residency_reason = held_->volume->reason();
    stats.needed_bricks = held_->needed_bricks;
    if (stats.atlas) {
        stats.room_for_bricks = held_->volume->atlas().capacity();
        stats.parts = std::max<size_t>(1, held_->parts.size());
    }
    if (frame.recorded())
        frame.tell("wall_ms", Json::of(stats.wall_ms));
    return stats;
}

Result<uint64_t> Renderer::count_samples(const Scene& scene, const SceneData& data) {
    counting_ = true;
    samples_ = 0;
    const Result<FrameStats> drawn = draw(scene, data);
    counting_ = false;
    if (!drawn)
        return tl::unexpected(drawn.error());
    return samples_;
}

std::vector<Image> Renderer::read_back() {
    const profile::Scope scope("read back");
    PALPATE_ASSERT(held_->targets.has_value());
    Targets& targets = *held_->targets;
    const size_t pixels = size_t{targets.size_px.x} * targets.size_px.y;
    const auto fetch = [&](GpuImage& image, size_t channels) {
        Buffer buffer(*device_, "read back", pixels * targets.eyes * channels * sizeof(float),
                      Memory::read_back);
        Commands commands(*device_);
        const Commands::Region region{.buffer_offset = 0,
                                      .image_offset = {},
                                      .size = {targets.size_px, 1},
                                      .layers = targets.eyes};
        commands.copy(image, buffer, std::span(&region, 1));
        commands.submit();
        commands.finish();
        std::vector<float> samples(pixels * targets.eyes * channels);
        std::memcpy(samples.data(), buffer.mapped().data(), buffer.bytes());
        return samples;
    };
    const std::vector<float> color = fetch(*targets.color, 4);
    const std::vector<float> values =
        targets.return_values ? fetch(*targets.values, 2) : std::vector<float>{};
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
