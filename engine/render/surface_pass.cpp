#include "engine/render/surface_pass.h"

#include <algorithm>
#include <limits>

#include "engine/render/surface_frame.h"
#include "engine/render/targets.h"
#include "spirv/surface_begin.h"
#include "spirv/surface_caps.h"
#include "spirv/surface_compose.h"
#include "spirv/surface_draw.h"
#include "spirv/surface_search.h"
#include "spirv/surface_shade.h"

namespace palpate {

static_assert(gpu::kMaxSurfaceLayers == kMaxSurfaces && gpu::kMaxSurfaceClips == kMaxClipPlanes);

namespace {

// Rows are drawn at a time for which no buffer is larger than this.
constexpr uint64_t kScratchBytes = uint64_t{256} << 20;

} // namespace

Result<void> SurfacePass::prepare(const Scene& scene, const SceneData& data, Commands& commands) {
    PALPATE_TRY(keep_surfaces(scene, data, commands));
    PALPATE_TRY(keep_styles(scene, commands));
    keep_scratch(scene);
    return {};
}

SurfacePass::~SurfacePass() {
    for (SurfaceStore::Held& held : surfaces_)
        store_->surfaces.drop(held);
}

Result<void> SurfacePass::keep_surfaces(const Scene& scene, const SceneData& data,
                                        Commands& commands) {
    made_blocks_ = 0;
    for (size_t i = scene.surfaces.size(); i < surfaces_.size(); ++i)
        store_->surfaces.drop(surfaces_[i]);
    surfaces_.resize(scene.surfaces.size());
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        std::optional<float> iso;
        if (scene.surfaces[i].live_iso)
            iso = static_cast<float>(*scene.surfaces[i].live_iso);
        const SceneSurface::Source source{iso, data.volume, data.meshes[i],
                                          scene.surfaces[i].live_labels,
                                          data.labels ? &*data.labels : nullptr};
        SurfaceStore::Held& held = surfaces_[i];
        // Another layer of this scene may show the same: that must not change.
        if (std::ranges::count(surfaces_, held.surface, &SurfaceStore::Held::surface) > 1)
            store_->surfaces.drop(held);
        const std::string name = fmt::format("surface {}", i + 1);
        PALPATE_TRY(const size_t made, store_->surfaces.take(held, name, source, commands));
        made_blocks_ += made;
    }
    return {};
}

Result<void> SurfacePass::keep_styles(const Scene& scene, Commands& commands) {
    StyledFor wanted{scene.surfaces, {}, {}};
    if (std::ranges::any_of(scene.surfaces, &SurfaceLayer::live_labels))
        wanted.label_layer = scene.labels;
    for (const SurfaceStore::Held& held : surfaces_)
        wanted.labels.emplace_back(held.surface->has_labels(), held.surface->largest_label());
    if (styled_for_ == wanted)
        return {};
    styled_for_.reset();
    std::vector<gpu::SurfaceStyleEntry> entries;
    first_styles_.clear();
    style_counts_.clear();
    has_opaque_.assign(surfaces_.size(), false);
    has_through_.assign(surfaces_.size(), false);
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        const SurfaceLayer& layer = scene.surfaces[i];
        const Shading& light = layer.shading;
        const glm::vec4 shading(light.ambient, light.diffuse, light.specular, light.shininess);
        const uint32_t count = surfaces_[i].surface->largest_label() + 1;
        first_styles_.push_back(static_cast<uint32_t>(entries.size()));
        style_counts_.push_back(count);
        for (uint32_t label = 0; label < count; ++label) {
            SurfaceStyle style = layer.live_labels && scene.labels
                                     ? style_of(layer, *scene.labels, label)
                                     : style_of(layer, label);
            if (label == 0 && surfaces_[i].surface->has_labels()) // background
                style.opacity = 0.0;
            const float value = surfaces_[i].surface->has_labels()
                                    ? static_cast<float>(label)
                                    : std::numeric_limits<float>::quiet_NaN();
            entries.push_back({glm::vec4(glm::vec3(style.color), static_cast<float>(style.opacity)),
                               shading, value});
            has_opaque_[i] = has_opaque_[i] || style.opacity >= 1.0;
            has_through_[i] = has_through_[i] || (style.opacity > 0.0 && style.opacity < 1.0);
        }
    }
    if (entries.size() >= gpu::kSurfaceStyleMask)
        return fail("surfaces: expected labels that add up to less than {} over all, found {}",
                    gpu::kSurfaceStyleMask, entries.size());
    see_through_ = std::find(has_through_.begin(), has_through_.end(), true) != has_through_.end();
    styles_.hold(store_->device, "surface styles", std::as_bytes(std::span(entries)), commands);
    styled_for_ = std::move(wanted);
    return {};
}

uint32_t SurfacePass::rows_at_a_time(const Scene& scene) const {
    const uint64_t most =
        std::min<uint64_t>(kScratchBytes, store_->device.limits().maxStorageBufferRange);
    uint64_t bytes = sizeof(uint64_t); // of a pixel, in the largest buffer
    if (see_through_)
        bytes *= scene.surface_depth;
    if (!scene.clip_planes.empty())
        bytes = std::max<uint64_t>(bytes, 2 * sizeof(int32_t) * surfaces_.size());
    return static_cast<uint32_t>(
        std::clamp<uint64_t>(most / (bytes * scene.size_px.x), 1, scene.size_px.y));
}

void SurfacePass::keep_scratch(const Scene& scene) {
    const uint32_t places = scene.size_px.x * rows_at_a_time(scene);
    const auto meshes = static_cast<uint32_t>(surfaces_.size());
    const bool clips = !scene.clip_planes.empty();
    const uint32_t depth = see_through_ ? scene.surface_depth : 0;
    uint64_t most_triangles = 1;
    for (const SurfaceStore::Held& held : surfaces_)
        for (const SurfaceArrays& arrays : held.surface->arrays())
            most_triangles = std::max<uint64_t>(most_triangles, arrays.capacity);
    const uint64_t large_bytes = most_triangles * sizeof(uint32_t);
    if (scratch_ && scratch_->places == places && scratch_->depth == depth &&
        scratch_->clips == clips && (!clips || scratch_->mesh_count == meshes) &&
        scratch_->large.bytes() >= large_bytes)
        return;
    scratch_.reset();
    const auto buffer = [&](const char* name, uint64_t bytes) {
        return Buffer(store_->device, name, bytes, Memory::device);
    };
    // A block's triangles are eight or more places (SurfacePool), and a chunk is eight bytes.
    scratch_.emplace(Scratch{
        places, meshes, depth, clips, buffer("nearest triangles", places * sizeof(uint64_t)),
        buffer("surface work", sizeof(gpu::SurfaceWork)),
        buffer("surface search", sizeof(gpu::SurfaceSearch)), buffer("wide triangles", large_bytes),
        buffer("surface chunks", std::max<uint64_t>(most_triangles, sizeof(glm::uvec2))),
        std::nullopt, std::nullopt, std::nullopt});
    if (depth > 0)
        scratch_->through.emplace(
            buffer("see-through triangles", uint64_t{places} * depth * sizeof(uint64_t)));
    if (clips) {
        scratch_->kept.emplace(buffer("kept by clip planes", places * sizeof(glm::vec2)));
        scratch_->counts.emplace(
            buffer("labels at cuts", uint64_t{places} * 2 * meshes * sizeof(int32_t)));
    }
}

// The pixels in which meshes can be seen. Layers of see-through ones are written in all.
PixelBox SurfacePass::seen_pixels(const View& view, glm::uvec2 size_px) const {
    const PixelBox all{glm::uvec2(0), size_px};
    if (see_through_)
        return all;
    PixelBox pixels;
    for (const SurfaceStore::Held& held : surfaces_) {
        const SceneSurface& surface = *held.surface;
        if (surface.arrays().empty())
            continue;
        if (!surface.bounds())
            return all;
        const auto seen =
            seen_pixels_of(view, surface.world_from_mesh(), *surface.bounds(), size_px);
        if (!seen)
            return all;
        pixels = united(pixels, *seen);
    }
    return pixels;
}

std::vector<SurfacePass::Part> SurfacePass::parts_of(const ViewFrame& frame,
                                                     const std::optional<PixelBox>& only) const {
    const Scene& scene = frame.scene;
    std::vector<SurfaceFrameMesh> meshes;
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        const SceneSurface& surface = *surfaces_[i].surface;
        meshes.push_back(
            {surface.world_from_mesh(), first_styles_[i], style_counts_[i],
             (surface.has_labels() ? gpu::kSurfaceHasLabels : 0u) |
                 (surface.has_outer_labels() ? gpu::kSurfaceHasOuterLabels : 0u) |
                 (surface.has_normals() && scene.surfaces[i].smooth ? gpu::kSurfaceHasNormals
                                                                    : 0u)});
    }
    const uint32_t step = rows_at_a_time(scene);
    std::vector<Part> parts;
    for (uint32_t eye = 0; eye < frame.views.size(); ++eye) {
        const View& view = frame.views[eye];
        gpu::SurfaceFrame block = surface_frame(view, eye, scene, meshes);
        if (only && scene.slices.empty()) {
            block.clears = 1;
            block.nothing = color_of_nothing(scene);
        }
        const PixelBox box =
            only ? of_whole_tiles(*only, scene.size_px) : seen_pixels(view, scene.size_px);
        for (uint32_t row = box.low.y; row < box.high.y; row += step) {
            const PixelBox rows{{box.low.x, row}, {box.high.x, std::min(row + step, box.high.y)}};
            block.low_px = rows.low;
            block.part_px = rows.high - rows.low;
            parts.push_back({&view, rows, frame.commands.upload(bytes_of(block))});
        }
    }
    return parts;
}

// The resources that every stage over pixels needs, in the order of their bindings.
std::vector<Bound> SurfacePass::pixel_bindings(BufferSlice frame, bool through, bool styles) {
    std::vector<Bound> bound{bind_uniform(gpu::kSurfaceFrame, frame)};
    if (styles)
        bound.push_back(bind_storage(gpu::kSurfaceStyles, styles_.get()));
    bound.push_back(bind_storage(gpu::kSurfaceNearest, scratch_->nearest, Use::storage_write));
    if (through)
        bound.push_back(bind_storage(gpu::kSurfaceThrough, *scratch_->through, Use::storage_write));
    return bound;
}

void SurfacePass::start_work(Commands& commands, uint32_t surface, const SurfaceArrays& arrays,
                             uint32_t turn, bool chunked) {
    const gpu::SurfaceWork work{
        0, 1, 1, 0, surface, turn, arrays.first_number, arrays.triangle_count, chunked ? 1u : 0u};
    const auto* words = reinterpret_cast<const uint32_t*>(&work);
    commands.fill(scratch_->work, std::span(words, sizeof work / sizeof *words));
}

// The shader and resources that draw the opaque triangles of a surface, or the see-through ones.
// The last resource is the list of triangles over many pixels; the work comes before it.
SurfacePass::Drawing SurfacePass::drawing(const Part& part, const SurfaceArrays& arrays,
                                          bool through) {
    Drawing drawing{{.has_through = through,
                     .has_clips = scratch_->clips,
                     .has_int64 = store_->device.has_int64_atomics()},
                    pixel_bindings(part.frame, through, true)};
    std::vector<Bound>& bound = drawing.bound;
    if (scratch_->clips)
        bound.push_back(bind_storage(gpu::kSurfaceKept, *scratch_->kept));
    if (scratch_->clips && !through)
        bound.push_back(bind_storage(gpu::kSurfaceCounts, *scratch_->counts, Use::storage_write));
    bound.push_back(bind_storage(gpu::kSurfacePositions, arrays.positions));
    bound.push_back(bind_storage(gpu::kSurfaceTriangles, arrays.triangles));
    bound.push_back(bind_storage(gpu::kSurfaceLabels, arrays.labels));
    bound.push_back(bind_storage(gpu::kSurfaceWork, scratch_->work, Use::storage_write));
    bound.push_back(bind_storage(gpu::kSurfaceLarge, scratch_->large, Use::storage_write));
    return drawing;
}

// Small triangles, which list those over many pixels, and then these. `turn` as in
// gpu::SurfaceWork.
void SurfacePass::draw(Commands& commands, const Part& part, uint32_t surface,
                       const SurfaceArrays& arrays, bool through, uint32_t turn) {
    Drawing small = drawing(part, arrays, through), large = small;
    small.bound.push_back(bind_storage(gpu::kSurfaceChunks, scratch_->chunks));
    large.shader.is_large = true;
    for (Bound& b : std::span(large.bound).last(2))
        b.use = Use::storage_read;
    const ComputePipeline& pipeline = store_->pipelines.get(small.shader);
    if (arrays.parts.empty()) {
        start_work(commands, surface, arrays, turn, false);
        const uint32_t groups =
            (arrays.triangle_count + gpu::kSurfaceGroup - 1) / gpu::kSurfaceGroup;
        commands.dispatch(pipeline, small.bound,
                          {std::min(groups, gpu::kSurfaceMostGroups),
                           (groups + gpu::kSurfaceMostGroups - 1) / gpu::kSurfaceMostGroups, 1});
        commands.dispatch_indirect(store_->pipelines.get(large.shader), large.bound,
                                   scratch_->work);
        return;
    }
    const std::vector<gpu::SurfaceBlock> blocks =
        nearest_first(*part.view, surfaces_[surface].surface->world_from_mesh(), arrays.parts);
    if (blocks.empty())
        return;
    const std::array search{
        bind_uniform(gpu::kSurfaceFrame, part.frame),
        bind_storage(gpu::kSurfaceNearest, scratch_->nearest),
        bind_storage(gpu::kSurfaceChunks, scratch_->chunks, Use::storage_write),
        bind_storage(gpu::kSurfaceBlocks, commands.upload(std::as_bytes(std::span(blocks)))),
        bind_storage(gpu::kSurfaceSearch, scratch_->search, Use::storage_write)};
    for (const auto& [first, count] : batches_of(blocks)) {
        // Caps count all triangles, also hidden ones.
        const bool hides = first > 0 && !(scratch_->clips && !through);
        const gpu::SurfaceSearch begin{0, 1, 1, surface, first, count, hides ? 1u : 0u};
        const auto* words = reinterpret_cast<const uint32_t*>(&begin);
        commands.fill(scratch_->search, std::span(words, sizeof begin / sizeof *words));
        commands.dispatch(store_->pipelines.get(spirv::SurfaceSearch{}), search,
                          {(count + 63) / 64, 1, 1});
        start_work(commands, surface, arrays, turn, true);
        commands.dispatch_indirect(pipeline, small.bound, scratch_->search);
        commands.dispatch_indirect(store_->pipelines.get(large.shader), large.bound,
                                   scratch_->work);
    }
}

void SurfacePass::record(const ViewFrame& frame, const Images& images,
                         const std::optional<PixelBox>& only) {
    Commands& commands = frame.commands;
    const bool clips = scratch_->clips;
    const std::vector<Part> parts = parts_of(frame, only);
    commands.begin_pass("surfaces");
    uint64_t drawn = 0;
    for (const Part& part : parts)
        drawn += part.box.count();
    if (drawn < frame.views.size() * PixelBox{glm::uvec2(0), frame.scene.size_px}.count() &&
        &images.color != &images.behind) { // elsewhere the picture is what lies behind
        commands.copy(images.behind, images.color);
        if (images.values)
            commands.copy(images.behind_values, *images.values);
    }
    for (const Part& part : parts) {
        const glm::uvec2 size = part.box.high - part.box.low;
        const glm::uvec3 pixels((size.x + 63) / 64, size.y, 1);
        const auto dispatch = [&](const Shader& shader, const std::vector<Bound>& bound) {
            commands.dispatch(store_->pipelines.get(shader), bound, pixels);
        };

        std::vector<Bound> begin = pixel_bindings(part.frame, see_through_, false);
        if (clips) {
            begin.push_back(bind_storage(gpu::kSurfaceKept, *scratch_->kept, Use::storage_write));
            begin.push_back(
                bind_storage(gpu::kSurfaceCounts, *scratch_->counts, Use::storage_write));
        }
        begin.push_back(
            bind_sampled(gpu::kSurfaceBehindValues, images.behind_values, store_->nearest));
        dispatch(spirv::SurfaceBegin{.has_through = see_through_, .has_clips = clips}, begin);

        // Without atomic operations on 64 bits: all depths, then which triangles are there.
        const uint32_t turns = store_->device.has_int64_atomics() ? 1 : 2;
        for (const bool through : {false, true})
            for (uint32_t turn = 0; turn < turns; ++turn)
                for (uint32_t i = 0; i < surfaces_.size(); ++i)
                    if (through ? has_through_[i] : has_opaque_[i] || (clips && turn == 0))
                        for (const SurfaceArrays& arrays : surfaces_[i].surface->arrays())
                            draw(commands, part, i, arrays, through, turn);

        if (clips) {
            std::vector<Bound> caps = pixel_bindings(part.frame, see_through_, true);
            caps.push_back(bind_storage(gpu::kSurfaceKept, *scratch_->kept));
            caps.push_back(bind_storage(gpu::kSurfaceCounts, *scratch_->counts));
            dispatch(spirv::SurfaceCaps{.has_through = see_through_}, caps);
        }
        for (uint32_t i = 0; i < surfaces_.size(); ++i)
            for (const SurfaceArrays& arrays : surfaces_[i].surface->arrays()) {
                std::vector<Bound> shade = pixel_bindings(part.frame, see_through_, true);
                shade.push_back(bind_storage(gpu::kSurfacePositions, arrays.positions));
                shade.push_back(bind_storage(gpu::kSurfaceNormals, arrays.normals));
                shade.push_back(bind_storage(gpu::kSurfaceTriangles, arrays.triangles));
                shade.push_back(bind_storage(gpu::kSurfaceLabels, arrays.labels));
                start_work(commands, i, arrays, gpu::kSurfaceDepths, false);
                shade.push_back(bind_storage(gpu::kSurfaceWork, scratch_->work));
                dispatch(spirv::SurfaceShade{.has_through = see_through_}, shade);
            }

        std::vector<Bound> compose = pixel_bindings(part.frame, see_through_, true);
        for (Bound& b : std::span(compose).subspan(2))
            b.use = Use::storage_read;
        compose.push_back(bind_storage_image(gpu::kSurfaceBehind, images.behind));
        compose.push_back(bind_storage_image(gpu::kSurfaceBehindValues, images.behind_values));
        compose.push_back(bind_storage_image(gpu::kSurfaceColor, images.color));
        if (images.values)
            compose.push_back(bind_storage_image(gpu::kSurfaceValues, *images.values));
        if (images.layers)
            compose.push_back(bind_storage_image(gpu::kSurfaceLayers, *images.layers));
        dispatch(spirv::SurfaceCompose{.has_through = see_through_,
                                       .has_layers = images.layers != nullptr,
                                       .has_values = images.values != nullptr},
                 compose);
    }
    commands.end_pass();
}

} // namespace palpate
