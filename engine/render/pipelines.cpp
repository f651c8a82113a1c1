#include "engine/render/pipelines.h"

#include <fmt/format.h>

#include <array>

#include "engine/render/shader_code.h"
#include "shaders/shared/interactive.h"
#include "shaders/shared/ray_cast.h"
#include "shaders/shared/slices.h"
#include "shaders/shared/tiles.h"
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

constexpr auto kUniform = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
constexpr auto kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
constexpr auto kSampled = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
constexpr auto kStorageImage = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;

// Bits in the order of the macros in CMakeLists.txt.
std::span<const uint32_t> ray_cast_code(const RayCastVariant& v) {
    const bool iso = v.mode == gpu::kModeIso;
    if (v.layers > 0)
        return spirv::ray_cast_layers[iso + 2 * v.labels + 4 * v.values + 8 * v.exact +
                                      16 * v.atlas];
    return spirv::ray_cast[iso + 2 * v.labels + 4 * v.slices + 8 * v.values + 16 * v.exact +
                           32 * v.atlas];
}

std::string name_of(const RayCastVariant& v) {
    constexpr const char* modes[] = {"mip", "alpha", "iso"};
    std::string name = fmt::format("ray_cast {}", modes[v.mode]);
    if (v.mode == gpu::kModeIso)
        name += fmt::format(" x{}", v.iso_count);
    for (const auto& [on, text] :
         {std::pair(v.preintegrated, " preintegrated"), std::pair(v.exact, " exact"),
          std::pair(v.shaded, " shaded"), std::pair(v.labels, " labels"),
          std::pair(v.slices, " slices"), std::pair(v.values, " values"),
          std::pair(v.no_data, " no-data"), std::pair(!v.skip, " unskipped"),
          std::pair(v.count, " counting"),
          std::pair(v.rays == gpu::kRaysEverySecond, " every second"),
          std::pair(v.rays == gpu::kRaysListed, " listed"),
          std::pair(v.rays == gpu::kRaysSparse, " sparse"), std::pair(v.atlas, " atlas"),
          std::pair(v.by_hand, " by hand"), std::pair(v.stored_gradients, " stored gradients")})
        if (on)
            name += text;
    if (v.layers > 0)
        name += fmt::format(" among {} layers", v.layers);
    return name;
}

struct SurfaceShader {
    const char* name;
    std::span<const uint32_t> code;
};

// Bits in the order of the macros in CMakeLists.txt.
SurfaceShader surface_shader(SurfaceStage stage, SurfaceVariant v) {
    switch (stage) {
        case SurfaceStage::begin:
            return {"surface_begin", spirv::surface_begin[v.through + 2 * v.clips]};
        case SurfaceStage::draw:
            return {"surface_draw", spirv::surface_draw[2 * v.through + 4 * v.clips + 8 * v.int64]};
        case SurfaceStage::draw_large:
            return {"surface_draw large",
                    spirv::surface_draw[1 + 2 * v.through + 4 * v.clips + 8 * v.int64]};
        case SurfaceStage::caps:
            return {"surface_caps", spirv::surface_caps[v.through]};
        case SurfaceStage::shade:
            return {"surface_shade", spirv::surface_shade[v.through]};
        case SurfaceStage::compose:
            return {"surface_compose",
                    spirv::surface_compose[v.through + 2 * v.layers + 4 * v.values]};
    }
    return {};
}

VkDescriptorType type_of(const Bound& bound) {
    if (bound.use == Use::uniform)
        return kUniform;
    if (std::holds_alternative<BufferSlice>(bound.resource))
        return kStorage;
    return bound.sampler ? kSampled : kStorageImage;
}

} // namespace

bool RayCastVariant::has_first_hits() const {
    return mode == gpu::kModeIso && !exact && layers == 0;
}

std::span<const uint32_t> ray_cast_shader() {
    return spirv::ray_cast[0];
}

std::span<const uint32_t> ray_cast_atlas_shader() {
    return spirv::ray_cast[32];
}

std::span<const uint32_t> surface_draw_shader() {
    return spirv::surface_draw[0];
}

template <class... Arguments>
ComputePipeline& Pipelines::made(std::unique_ptr<ComputePipeline>& pipeline,
                                 Arguments&&... arguments) {
    pipeline = std::make_unique<ComputePipeline>(*device_, std::forward<Arguments>(arguments)...);
    all_.push_back(pipeline.get());
    return *pipeline;
}

double Pipelines::creation_ms() const {
    double sum = 0;
    for (const ComputePipeline* pipeline : all_)
        sum += pipeline->creation_ms();
    return sum;
}

double Pipelines::wait_ms() const {
    double sum = 0;
    for (const ComputePipeline* pipeline : all_)
        sum += pipeline->wait_ms();
    return sum;
}

ComputePipeline& Pipelines::ray_cast(const RayCastVariant& variant) {
    std::unique_ptr<ComputePipeline>& pipeline = ray_casts_[variant];
    if (!pipeline) {
        std::vector<BindingSlot> slots{{gpu::kRayFrame, kUniform}, {gpu::kRayVolume, kSampled}};
        if (variant.mode != gpu::kModeIso)
            slots.insert(slots.end(), {{gpu::kRayTable, kSampled},
                                       {gpu::kRayGradients, kSampled},
                                       {gpu::kRaySlabs, kStorage}});
        if (variant.exact)
            slots.push_back({gpu::kRayCorners, kSampled});
        if (variant.exact && variant.mode != gpu::kModeIso)
            slots.push_back({gpu::kRaySmoothTable, kSampled});
        if (variant.labels) {
            slots.push_back({gpu::kRayLabels, kSampled});
            slots.push_back({gpu::kRayStyles, kStorage});
        }
        if (variant.slices) {
            slots.push_back({gpu::kRayBehind, kSampled});
            slots.push_back({gpu::kRayBehindValues, kSampled});
        }
        if (variant.has_first_hits())
            slots.push_back({gpu::kRayFirstHits, kStorage});
        slots.push_back({gpu::kRayColor, kStorageImage});
        if (variant.values)
            slots.push_back({gpu::kRayValues, kStorageImage});
        slots.push_back({gpu::kRayCells, kSampled});
        slots.push_back({gpu::kRayTiles, kStorage});
        slots.push_back({gpu::kRayTileGroups, kStorage});
        slots.push_back({gpu::kRaySpans, kStorage});
        if (variant.atlas) {
            slots.push_back({gpu::kRayPages, kSampled});
            slots.push_back({gpu::kRayAtlas, kUniform});
            slots.push_back({gpu::kRayCarry, kStorageImage});
        }
        if (variant.layers > 0)
            slots.push_back({gpu::kRaySurfaces, kSampled});
        const std::array<uint32_t, 11> constants{variant.mode,      variant.preintegrated,
                                                 variant.shaded,    variant.no_data,
                                                 variant.iso_count, variant.skip,
                                                 variant.count,     variant.rays,
                                                 variant.by_hand,   variant.stored_gradients,
                                                 variant.layers};
        made(pipeline, name_of(variant), ray_cast_code(variant), slots, constants);
    }
    return *pipeline;
}

ComputePipeline& Pipelines::tiles(uint32_t which, bool spans) {
    std::unique_ptr<ComputePipeline>& pipeline = tiles_[{which, spans}];
    if (!pipeline) {
        const BindingSlot slots[] = {{gpu::kTileFrame, kUniform},
                                     {gpu::kTileCells, kSampled},
                                     {gpu::kTileGroups, kStorage},
                                     {gpu::kTileEntries, kStorage},
                                     {gpu::kTileSpans, kStorage}};
        const uint32_t constants[] = {which, spans};
        made(pipeline, fmt::format("tiles {}{}", which, spans ? " spans" : ""), spirv::tiles[0],
             slots, constants);
    }
    return *pipeline;
}

ComputePipeline& Pipelines::mip_slabs() {
    if (!mip_slabs_) {
        const BindingSlot slots[] = {{gpu::kTileFrame, kUniform},
                                     {gpu::kTileCells, kSampled},
                                     {gpu::kTileEntries, kStorage},
                                     {gpu::kTileSlabs, kStorage}};
        made(mip_slabs_, "MIP slabs", spirv::mip_slabs[0], slots);
    }
    return *mip_slabs_;
}

ComputePipeline& Pipelines::interpolate() {
    if (!interpolate_) {
        const BindingSlot slots[] = {{gpu::kInterpolateBlock, kUniform},
                                     {gpu::kInterpolateColor, kStorageImage},
                                     {gpu::kInterpolateSpans, kStorage},
                                     {gpu::kInterpolateGroups, kStorage},
                                     {gpu::kInterpolateRays, kStorage}};
        made(interpolate_, "interpolate", spirv::interpolate[0], slots);
    }
    return *interpolate_;
}

ComputePipeline& Pipelines::enlarge() {
    if (!enlarge_) {
        const BindingSlot slots[] = {{gpu::kEnlargeBlock, kUniform},
                                     {gpu::kEnlargeFew, kSampled},
                                     {gpu::kEnlargeColor, kStorageImage},
                                     {gpu::kEnlargeSpans, kStorage}};
        made(enlarge_, "enlarge", spirv::enlarge[0], slots);
    }
    return *enlarge_;
}

ComputePipeline& Pipelines::judge() {
    if (!judge_) {
        const BindingSlot slots[] = {{gpu::kJudgeBlock, kUniform},
                                     {gpu::kJudgeColor, kSampled},
                                     {gpu::kJudgeTruth, kSampled},
                                     {gpu::kJudgeSquares, kStorage}};
        made(judge_, "judge", spirv::judge[0], slots);
    }
    return *judge_;
}

ComputePipeline& Pipelines::surface(SurfaceStage stage, SurfaceVariant v,
                                    std::span<const Bound> bound) {
    const SurfaceShader shader = surface_shader(stage, v);
    std::unique_ptr<ComputePipeline>& pipeline = surfaces_[shader.code.data()];
    if (!pipeline) {
        std::vector<BindingSlot> slots;
        for (const Bound& b : bound)
            slots.push_back({b.binding, type_of(b)});
        made(pipeline,
             fmt::format("{}{}{}", shader.name, v.through ? " see-through" : "",
                         v.clips ? " clipped" : ""),
             shader.code, slots);
    }
    return *pipeline;
}

ComputePipeline& Pipelines::slices(bool labels, bool atlas, bool by_hand) {
    std::unique_ptr<ComputePipeline>& pipeline = slices_[labels + 2u * atlas + 4u * by_hand];
    if (!pipeline) {
        std::vector<BindingSlot> slots{{gpu::kSliceFrame, kUniform},
                                       {gpu::kSliceVolume, kSampled},
                                       {gpu::kSliceTable, kSampled}};
        if (labels) {
            slots.push_back({gpu::kSliceLabels, kSampled});
            slots.push_back({gpu::kSliceStyles, kStorage});
        }
        slots.push_back({gpu::kSlicePlanes, kUniform});
        slots.push_back({gpu::kSliceColor, kStorageImage});
        slots.push_back({gpu::kSliceValues, kStorageImage});
        if (atlas) {
            slots.push_back({gpu::kSlicePages, kSampled});
            slots.push_back({gpu::kSliceAtlas, kUniform});
        }
        const uint32_t constants[] = {by_hand};
        made(pipeline,
             fmt::format("slices{}{}{}", labels ? " labels" : "", atlas ? " atlas" : "",
                         by_hand ? " by hand" : ""),
             spirv::slices[labels + 2 * atlas], slots, constants);
    }
    return *pipeline;
}

} // namespace palpate
