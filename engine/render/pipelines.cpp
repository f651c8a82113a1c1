#include "engine/render/pipelines.h"

#include "spirv/surface_begin.h"
#include "spirv/surface_caps.h"
#include "spirv/surface_compose.h"
#include "spirv/surface_draw.h"
#include "spirv/surface_shade.h"

namespace palpate {

namespace {

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

ComputePipeline& Pipelines::surface(SurfaceStage stage, SurfaceVariant variant,
                                    std::span<const Bound>) {
    return get(shader_of(stage, variant));
}

} // namespace palpate
