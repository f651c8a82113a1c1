#include "engine/render/pipelines.h"

#include "shaders/shared/ray_cast.h"
#include "spirv/enlarge.h"
#include "spirv/interpolate.h"
#include "spirv/judge.h"
#include "spirv/mip_slabs.h"
#include "spirv/ray_cast.h"
#include "spirv/ray_cast_layers.h"
#include "spirv/slices.h"
#include "spirv/surface_begin.h"
#include "spirv/surface_caps.h"
#include "spirv/surface_compose.h"
#include "spirv/surface_draw.h"
#include "spirv/surface_shade.h"
#include "spirv/tiles.h"

namespace palpate {

namespace {

Shader shader_of(const RayCastVariant& v) {
    const auto filled = [&](auto shader) {
        shader.is_iso = v.mode == gpu::kModeIso;
        shader.has_labels = v.labels;
        shader.has_values = v.values;
        shader.is_exact = v.exact;
        shader.has_atlas = v.atlas;
        shader.mode = v.mode;
        shader.preintegrated = v.preintegrated;
        shader.shaded = v.shaded;
        shader.has_no_data = v.no_data;
        shader.iso_count = v.iso_count;
        shader.skip = v.skip;
        shader.count = v.count;
        shader.rays = v.rays;
        shader.manual = v.by_hand;
        shader.stored = v.stored_gradients;
        return shader;
    };
    if (v.layers > 0)
        return filled(spirv::RayCastLayers{.layer_count = v.layers});
    return filled(spirv::RayCast{.has_slices = v.slices});
}

Shader shader_of(SurfaceStage stage, const SurfaceVariant& v) {
    switch (stage) {
        case SurfaceStage::begin:
            return spirv::SurfaceBegin{.has_through = v.through, .has_clips = v.clips};
        case SurfaceStage::draw:
        case SurfaceStage::draw_large:
            return spirv::SurfaceDraw{.is_large = stage == SurfaceStage::draw_large,
                                      .has_through = v.through,
                                      .has_clips = v.clips,
                                      .has_int64 = v.int64};
        case SurfaceStage::caps:
            return spirv::SurfaceCaps{.has_through = v.through};
        case SurfaceStage::shade:
            return spirv::SurfaceShade{.has_through = v.through};
        default:
            return spirv::SurfaceCompose{
                .has_through = v.through, .has_layers = v.layers, .has_values = v.values};
    }
}

} // namespace

bool RayCastVariant::has_first_hits() const {
    return mode == gpu::kModeIso && !exact && layers == 0;
}

ComputePipeline& Pipelines::ray_cast(const RayCastVariant& variant) {
    return cache_.get(shader_of(variant));
}

ComputePipeline& Pipelines::tiles(uint32_t which, bool spans) {
    return cache_.get(spirv::Tiles{.list = which, .write_spans = spans});
}

ComputePipeline& Pipelines::mip_slabs() {
    return cache_.get(spirv::MipSlabs{});
}

ComputePipeline& Pipelines::interpolate() {
    return cache_.get(spirv::Interpolate{});
}

ComputePipeline& Pipelines::enlarge() {
    return cache_.get(spirv::Enlarge{});
}

ComputePipeline& Pipelines::judge() {
    return cache_.get(spirv::Judge{});
}

ComputePipeline& Pipelines::surface(SurfaceStage stage, SurfaceVariant variant,
                                    std::span<const Bound>) {
    return cache_.get(shader_of(stage, variant));
}

ComputePipeline& Pipelines::slices(bool labels, bool atlas, bool by_hand) {
    return cache_.get(spirv::Slices{.has_labels = labels, .has_atlas = atlas, .manual = by_hand});
}

} // namespace palpate
