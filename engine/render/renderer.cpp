#include "engine/render/renderer.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
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

Renderer::Renderer(GpuDevice& device, RendererOptions options)
    : device_(&device),
      options_(options),
      pipelines_(device),
      linear_(device, SampleFilter::linear, Edge::clamp),
      nearest_(device, SampleFilter::nearest, Edge::clamp),
      label_sampler_(device, SampleFilter::nearest, Edge::border_zero),
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
    held_->needed.reset();
    held_->parts.clear();
    held_->styles.drop();
    held_->styles_of.reset();
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
        if (std::pair wanted(*scene.labels, largest); held_->styles_of != wanted) {
            const auto styles = make_label_styles(*scene.labels, largest);
            held_->styles.hold(*device_, "label styles", std::as_bytes(std::span(styles)),
                               commands);
            held_->styles_of = std::move(wanted);
        }
        inputs.style_count = largest + 1;
    } else {
        held_->styles.drop();
        held_->styles_of.reset();
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
        Part part{glm::uvec3(0), data.volume.brick_count(), all_eyes(scene), {}};
        if (held_->volume->is_atlas() && !held_->all_fit)
            part.bricks = held_->needed->sliced();
        uploaded = show_part(part, true, commands);
        record_slices(commands, scene);
    }
    if (!scene.surfaces.empty())
        record_surfaces(commands, scene);
    else if (scene.ray_cast)
        record_background(commands, scene);
    return uploaded;
}

} // namespace palpate
