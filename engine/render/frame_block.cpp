#include "engine/render/frame_block.h"

#include <cmath>
#include <tuple>

#include "engine/base/assert.h"
#include "engine/scene/least_value.h"
#include "engine/volume/extent.h"
#include "shaders/shared/ray_cast.h"

namespace palpate {

namespace {

// Everything linear that turns world into index; the origin is dealt with by differences, so that a
// far-away patient costs no digits.
struct IndexSpace {
    explicit IndexSpace(const Grid& grid)
        : index_from_world(glm::inverse(glm::dmat3(grid.world_from_index))),
          world_from_index(grid.world_from_index),
          origin_mm(grid.world_from_index[3]) {}

    glm::dvec3 point(glm::dvec3 world_mm) const {
        return index_from_world * (world_mm - origin_mm);
    }
    glm::dvec3 direction(glm::dvec3 world_mm) const { return index_from_world * world_mm; }
    // A plane through `point_mm` with a unit normal, as (normal, offset) in mm over index.
    gpu::ClipPlaneIndex plane(glm::dvec3 point_mm, glm::dvec3 normal) const {
        const glm::dvec3 n = glm::normalize(normal);
        return {glm::vec3(glm::transpose(world_from_index) * n),
                static_cast<float>(glm::dot(n, origin_mm - point_mm))};
    }

    glm::dmat3 index_from_world;
    glm::dmat3 world_from_index;
    glm::dvec3 origin_mm;
};

// Index positions of one volume from those of another: matrix * index + origin.
struct IndexMap {
    IndexMap(const Grid& to, const IndexSpace& from) {
        const IndexSpace space(to);
        matrix = space.index_from_world * from.world_from_index;
        origin = space.point(from.origin_mm);
    }
    // In texture coordinates of `size` texels.
    std::pair<glm::mat3, glm::vec3> to_texture(glm::uvec3 texels) const {
        const glm::dvec3 size(texels);
        return {glm::mat3(matrix[0] / size, matrix[1] / size, matrix[2] / size),
                glm::vec3((origin + 0.5) / size)};
    }
    glm::dmat3 matrix;
    glm::dvec3 origin;
};

// How a texel is looked up in a table over low .. high. Entry i of n lies at (i + 0.5) / n and
// stands for low + i / (n - 1) * width.
struct TableLookup {
    TableLookup(float value_scale, float value_bias, double low, double high) {
        const double entries = kTransferTableSize, width = high - low;
        const double shrink = (entries - 1.0) / entries;
        scale = static_cast<float>(value_scale / width * shrink);
        bias = static_cast<float>((value_bias - low) / width * shrink + 0.5 / entries);
    }
    float scale, bias;
};

// The most that a vector of 1 mm can measure along an index axis, in samples.
double samples_per_mm(const IndexSpace& space) {
    const glm::dmat3 rows = glm::transpose(space.index_from_world);
    return std::max({glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2])});
}

double farthest_mm(const View& view, const IndexSpace& space, const Grid& grid) {
    double most = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index((corner & 1) * (grid.size.x - 1.0),
                               (corner >> 1 & 1) * (grid.size.y - 1.0),
                               (corner >> 2) * (grid.size.z - 1.0));
        most = std::max(
            most, glm::length(space.world_from_index * index + space.origin_mm - view.eye_mm));
    }
    return most;
}

// How far the rays of a tile spread about the one through its middle: see FrameEye. Unit vectors
// through two points of the plane at distance 1 differ by at most the points' distance.
void fill_spread(gpu::FrameEye& eye, const View& view, const IndexSpace& space, const Grid& grid,
                 glm::uvec2 size_px) {
    const glm::dvec2 pixel((view.right_edge - view.left) / size_px.x,
                           (view.top - view.bottom) / size_px.y);
    const double widest = 0.5 * gpu::kTileSide * glm::length(pixel) * samples_per_mm(space);
    const bool parallel = view.projection == Projection::orthographic;
    eye.spread = parallel ? glm::vec2(widest, 0.0f) : glm::vec2(0.0f, widest);
    eye.reach = static_cast<float>(farthest_mm(view, space, grid));
}

gpu::FrameEye make_eye(const View& view, const IndexSpace& space) {
    gpu::FrameEye eye{};
    eye.eye = glm::vec3(space.point(view.eye_mm));
    eye.right = glm::vec3(space.direction(view.right));
    eye.up = glm::vec3(space.direction(view.up));
    eye.forward = glm::vec3(space.direction(view.forward));
    eye.bounds = glm::vec4(view.left, view.right_edge, view.bottom, view.top);
    eye.projection =
        view.projection == Projection::orthographic ? gpu::kOrthographic : gpu::kPerspective;
    return eye;
}

void fill_light(gpu::Frame& frame, const RayCastLayer& layer, const Camera& camera,
                const IndexSpace& space) {
    frame.index_from_world = glm::mat3(space.index_from_world);
    frame.occlusion_mm = static_cast<float>(layer.occlusion_mm);
    if (!layer.light)
        return;
    const glm::dvec3 light = towards(*layer.light, camera);
    frame.light_index = glm::vec3(space.direction(light));
    frame.light_covector = glm::vec3(glm::transpose(space.world_from_index) * light);
}

void fill_ray_cast(gpu::Frame& frame, const RayCastLayer& layer, const Grid& grid,
                   double values_per_entry) {
    RayCastLayer stepped = layer;
    if (layer.integrator == Integrator::exact) // only for what counts in steps, like clearances
        stepped.step_mm = 0.0;
    frame.step = static_cast<float>(step_mm_of(stepped, grid));
    const double detail_entries =
        layer.transfer.colors.empty()
            ? 1.0
            : std::max(finest_detail(layer.transfer) / values_per_entry, 1.0);
    if (layer.jitter_seed && layer.integrator != Integrator::exact) {
        frame.jitter_mm = frame.step;
        frame.jitter_seed = *layer.jitter_seed;
    }
    frame.mip_sign = shows_least_value(layer.transfer) ? -1.0f : 1.0f;
    frame.sub_steps = static_cast<float>(layer.sub_steps);
    frame.sub_steps_per_bend =
        static_cast<float>(layer.sub_steps * layer.sub_steps / (8.0 * detail_entries));
    frame.span_tolerance = static_cast<float>(span_tolerance(layer.sub_steps));
    frame.min_transmittance = static_cast<float>(layer.min_transmittance);
    frame.opacity_unit_mm = static_cast<float>(layer.transfer.opacity_unit_mm);
    const Shading shading = layer.shading.value_or(Shading{});
    frame.shading =
        glm::vec4(shading.ambient, shading.diffuse, shading.specular, shading.shininess);
    PALPATE_ASSERT_CMP(layer.isos.size(), <=, kMaxIsos);
    for (size_t i = 0; i < layer.isos.size(); ++i) {
        frame.iso_texels[i] =
            static_cast<float>((layer.isos[i].value - frame.value_bias) / frame.value_scale);
        frame.iso_colors[i] =
            glm::vec4(glm::vec3(layer.isos[i].color), static_cast<float>(layer.isos[i].opacity));
    }
}

} // namespace

static_assert(gpu::kMaxClips == kMaxClipPlanes && gpu::kMaxIsoValues == kMaxIsos &&
              gpu::kMaxSlices == kMaxSlices);

gpu::Frame make_frame_block(const Scene& scene, const SceneData& data, std::span<const View> views,
                            const FrameInputs& inputs) {
    const Grid& grid = data.volume.grid();
    const IndexSpace space(grid);
    gpu::Frame frame{};
    PALPATE_ASSERT(!views.empty() && views.size() <= 2);
    for (size_t i = 0; i < views.size(); ++i) {
        frame.eyes[i] = make_eye(views[i], space);
        fill_spread(frame.eyes[i], views[i], space, grid, scene.size_px);
    }
    PALPATE_ASSERT_CMP(scene.clip_planes.size(), <=, kMaxClipPlanes);
    for (size_t i = 0; i < scene.clip_planes.size(); ++i)
        frame.clips[i] = space.plane(scene.clip_planes[i].point_mm, scene.clip_planes[i].normal);
    frame.last = glm::vec3(grid.size) - 1.0f;
    frame.cell_last = glm::vec3(inputs.cells) - 1.0f;
    frame.cell_texture = glm::vec3(1.0 / glm::dvec3(inputs.cells));
    frame.cell_side = static_cast<float>(inputs.cell_side);
    frame.cell_margin = static_cast<float>(inputs.cell_margin / inputs.value_scale);
    frame.texture_from_index = glm::vec3(1.0 / glm::dvec3(grid.size));
    frame.world_from_index_covector = glm::mat3(glm::transpose(space.index_from_world));
    if (data.labels) {
        const Grid& labels = data.labels->grid();
        std::tie(frame.label_from_index, frame.label_origin) =
            IndexMap(labels, space).to_texture(labels.size);
    }
    frame.background = glm::vec3(scene.background);
    frame.value_scale = inputs.value_scale;
    frame.value_bias = inputs.value_bias;
    const TableLookup lookup(inputs.value_scale, inputs.value_bias, inputs.table_low,
                             inputs.table_high);
    frame.table_scale = lookup.scale;
    frame.table_bias = lookup.bias;
    const auto weighted = [](glm::vec4 entry) {
        return glm::vec4(glm::vec3(entry.x, entry.y, entry.z) * entry.w, entry.w);
    };
    frame.table_first = weighted(inputs.table_first);
    frame.table_last = weighted(inputs.table_last);
    if (scene.ray_cast) {
        fill_ray_cast(frame, *scene.ray_cast, grid,
                      (inputs.table_high - inputs.table_low) / (kTransferTableSize - 1.0));
        fill_light(frame, *scene.ray_cast, scene.camera, space);
    }
    if (scene.labels) {
        frame.label_weight = static_cast<float>(scene.labels->ray_cast_weight);
        frame.label_opacity = static_cast<float>(scene.labels->slice_opacity);
        frame.outline_px = static_cast<float>(scene.labels->outline_px);
    }
    frame.size_px = scene.size_px;
    frame.rays = scene.size_px;
    frame.px_per_ray = 1.0f;
    frame.clip_count = static_cast<uint32_t>(scene.clip_planes.size());
    frame.slice_count = static_cast<uint32_t>(scene.slices.size());
    frame.style_count = inputs.style_count;
    return frame;
}

std::vector<gpu::SliceIndex> make_slice_planes(const Scene& scene, const Grid& grid) {
    const IndexSpace space(grid);
    const double finest = smallest_spacing_mm(grid);
    std::vector<gpu::SliceIndex> planes;
    for (const SliceLayer& layer : scene.slices) {
        const gpu::ClipPlaneIndex plane = space.plane(layer.point_mm, layer.normal);
        const double samples = std::max(1.0, std::ceil(layer.slab_mm / finest));
        planes.push_back(
            {plane.normal, plane.offset,
             glm::vec3(space.direction(glm::normalize(layer.normal)) * (layer.slab_mm / samples)),
             static_cast<uint32_t>(samples),
             (layer.interpolation == Interpolation::cubic ? gpu::kSliceCubic : 0u) |
                 (layer.slab_mode == SlabMode::maximum   ? gpu::kSliceMaximum
                  : layer.slab_mode == SlabMode::minimum ? gpu::kSliceMinimum
                                                         : 0u)});
    }
    return planes;
}

gpu::SliceOver make_slice_over(const Scene& scene, const SceneData& data,
                               const OverInputs& inputs) {
    const IndexSpace space(data.volume.grid());
    gpu::SliceOver over{};
    if (scene.fusion) {
        const Grid& grid = data.fused->grid();
        const IndexMap map(grid, space);
        const TableLookup lookup(inputs.value_scale, inputs.value_bias, inputs.table_low,
                                 inputs.table_high);
        over.fused_from_index = glm::mat3(map.matrix);
        over.fused_origin = glm::vec3(map.origin);
        over.fused_last = glm::vec3(grid.size) - 1.0f;
        over.fused_texture = glm::vec3(1.0 / glm::dvec3(grid.size));
        over.fused_table_scale = lookup.scale;
        over.fused_table_bias = lookup.bias;
        over.fused_opacity = static_cast<float>(scene.fusion->opacity);
        over.fused_unit_mm = static_cast<float>(scene.fusion->transfer.opacity_unit_mm);
    }
    if (scene.overlay) {
        const Grid& grid = data.overlay->grid();
        std::tie(over.overlay_from_index, over.overlay_origin) =
            IndexMap(grid, space).to_texture(grid.size);
        over.overlay_opacity = static_cast<float>(scene.overlay->slice_opacity);
        over.overlay_outline_px = static_cast<float>(scene.overlay->outline_px);
        over.overlay_styles = inputs.style_count;
    }
    return over;
}

std::vector<glm::vec4> make_label_styles(const LabelLayer& layer, uint32_t largest_label) {
    std::vector<glm::vec4> styles{glm::vec4(1.0f)};
    for (uint32_t label = 1; label <= largest_label; ++label) {
        const LabelStyle style = style_of(layer, label);
        styles.emplace_back(glm::vec3(style.color), style.visible ? 1.0f : 0.0f);
    }
    return styles;
}

} // namespace palpate
