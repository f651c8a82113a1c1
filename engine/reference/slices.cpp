#include "engine/reference/slices.h"

#include <cmath>
#include <limits>

#include "engine/reference/label_edges.h"
#include "engine/reference/march.h"
#include "engine/volume/extent.h"

namespace palpate::reference {

namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

// A plane through the outermost samples is met although rounding leaves the point beside the box.
constexpr double kSlack = 1e-4; // samples

bool within(glm::dvec3 index, glm::dvec3 last, double slack) {
    return glm::all(glm::greaterThanEqual(index, glm::dvec3(-slack))) &&
           glm::all(glm::lessThanEqual(index, last + slack));
}

std::array<double, 4> catmull_rom_weights(double f) {
    const double f2 = f * f, f3 = f2 * f;
    return {0.5 * (-f3 + 2.0 * f2 - f), 0.5 * (3.0 * f3 - 5.0 * f2 + 2.0),
            0.5 * (-3.0 * f3 + 4.0 * f2 + f), 0.5 * (f3 - f2)};
}

std::optional<double> plane_distance(glm::dvec3 point, glm::dvec3 normal, const LocalRay& ray) {
    const double rate = glm::dot(normal, ray.direction);
    if (rate == 0.0)
        return std::nullopt;
    return glm::dot(normal, point - ray.origin_mm) / rate;
}

} // namespace

double catmull_rom(const Volume& volume, glm::dvec3 index) {
    const glm::dvec3 low = glm::floor(index);
    const auto wx = catmull_rom_weights(index.x - low.x);
    const auto wy = catmull_rom_weights(index.y - low.y);
    const auto wz = catmull_rom_weights(index.z - low.z);
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    double sum = 0.0;
    for (int z = 0; z < 4; ++z)
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 4; ++x) {
                const glm::ivec3 at =
                    glm::clamp(glm::ivec3(low) + glm::ivec3(x, y, z) - 1, glm::ivec3(0), last);
                sum += wz[z] * wy[y] * wx[x] * volume.value(glm::uvec3(at));
            }
    return sum;
}

Slices::Slices(const Scene& scene, const SceneData& data, const Rays& rays, const Sampler& sampler,
               std::function<glm::dvec3(double)> color)
    : scene_(scene),
      data_(data),
      rays_(rays),
      sampler_(sampler),
      color_(std::move(color)),
      cursor_(data.volume) {
    if (scene.fusion)
        fused_.emplace(Fused{SampleCursor(*data.fused), make_table(scene.fusion->transfer)});
}

double Slices::value_at(const SliceLayer& slice, glm::dvec3 index) {
    return slice.interpolation == Interpolation::linear ? cursor_.value(index)
                                                        : catmull_rom(data_.volume, index);
}

double Slices::slab_value(const SliceLayer& slice, glm::dvec3 normal, glm::dvec3 index) {
    const double finest = smallest_spacing_mm(data_.volume.grid());
    const double samples = std::max(1.0, std::ceil(slice.slab_mm / finest));
    const glm::dvec3 step = rays_.index_from_local() * normal * (slice.slab_mm / samples);
    double sum = 0.0, count = 0.0, maximum = kNoValue, minimum = kNoValue;
    for (double i = 0.0; i < samples; i += 1.0) {
        const glm::dvec3 at = index + (i + 0.5 - 0.5 * samples) * step;
        if (!within(at, rays_.last(), 0.0))
            continue;
        const double value = value_at(slice, at);
        if (std::isnan(value))
            continue;
        sum += value;
        count += 1.0;
        maximum = std::isnan(maximum) ? value : std::max(maximum, value);
        minimum = std::isnan(minimum) ? value : std::min(minimum, value);
    }
    if (slice.slab_mode == SlabMode::minimum)
        return minimum;
    if (slice.slab_mode == SlabMode::maximum)
        return maximum;
    return count > 0.0 ? sum / count : kNoValue;
}

glm::dvec3 Slices::with_fusion(glm::dvec3 local_mm, glm::dvec3 color) {
    const Volume& fused = *data_.fused;
    const glm::dvec3 index =
        index_point(fused.grid(), local_mm + glm::dvec3(data_.volume.grid().world_from_index[3]));
    if (!within(index, glm::dvec3(fused.size()) - 1.0, 0.0))
        return color;
    const double value = fused_->cursor.value(index);
    if (std::isnan(value))
        return color;
    const glm::dvec4 entry = nearest_entry(fused_->table, value);
    const FusionLayer& layer = *scene_.fusion;
    const double weight = layer.opacity * -std::expm1(-entry.w * layer.transfer.opacity_unit_mm);
    return glm::mix(color, glm::dvec3(entry), weight);
}

uint32_t Slices::overlay_at(glm::dvec3 local_mm) const {
    const Volume& overlay = *data_.overlay;
    const glm::dvec3 nearest =
        glm::floor(index_point(overlay.grid(),
                               local_mm + glm::dvec3(data_.volume.grid().world_from_index[3])) +
                   0.5);
    if (!within(nearest, glm::dvec3(overlay.size()) - 1.0, 0.0))
        return 0;
    const auto label = static_cast<uint32_t>(overlay.value(glm::uvec3(nearest)));
    return label != 0 && style_of(*scene_.overlay, label).visible ? label : 0;
}

template <class Shown>
glm::dvec3 Slices::with_labels(const LabelLayer& layer, const Shown& shown, const SliceLayer& slice,
                               glm::dvec3 normal, glm::dvec2 pixel, glm::dvec3 local_mm,
                               glm::dvec3 color) const {
    const uint32_t label = shown(local_mm);
    if (label == 0)
        return color;
    const LabelStyle style = style_of(layer, label);
    const glm::dvec2 sides[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    for (const glm::dvec2 side : sides) {
        if (!(layer.outline_px > 0.0))
            break;
        const LocalRay beside = rays_.through(pixel + layer.outline_px * side);
        const auto t = plane_distance(rays_.local_point(slice.point_mm), normal, beside);
        if (t && shown(beside.origin_mm + *t * beside.direction) != label)
            return style.color;
    }
    return glm::mix(color, style.color, layer.slice_opacity);
}

glm::dvec3 Slices::with_smooth_labels(
    const LabelLayer& layer, const Volume& labels,
    const std::function<glm::dvec3(glm::dvec3 local_mm)>& to_index, const SliceLayer& slice,
    glm::dvec3 normal, glm::dvec2 pixel, glm::dvec3 local_mm, glm::dvec3 color) const {
    const auto label_of = [&](glm::ivec3 at) -> uint32_t {
        if (at != glm::clamp(at, glm::ivec3(0), glm::ivec3(labels.size()) - 1))
            return 0;
        const auto label = static_cast<uint32_t>(labels.value(glm::uvec3(at)));
        return label != 0 && style_of(layer, label).visible ? label : 0;
    };
    const auto index_beside = [&](glm::dvec2 aside) {
        const LocalRay ray = rays_.through(pixel + aside);
        const auto t = plane_distance(rays_.local_point(slice.point_mm), normal, ray);
        return to_index(ray.origin_mm + t.value_or(0.0) * ray.direction);
    };
    const glm::dvec3 here = to_index(local_mm);
    const LabelPlace place = label_place(label_of, here);
    const glm::dvec3 across = index_beside({1, 0}) - here, down = index_beside({0, 1}) - here;
    const double slope =
        glm::length(glm::dvec2(glm::dot(place.slope, across), glm::dot(place.slope, down)));
    const double depth_px = place.margin / std::max(slope, 1e-6);
    bool edge = false;
    if (std::max(glm::length(across), glm::length(down)) * layer.outline_px > 0.5)
        for (int i = 0; i < 8; ++i) {
            const double angle = glm::radians(45.0 * i);
            const glm::dvec2 aside(std::cos(angle), std::sin(angle));
            edge = edge || label_place(label_of, index_beside(layer.outline_px * aside)).label !=
                               place.label;
        }
    const auto covered = [&](uint32_t label, double depth, bool is_edge) {
        return glm::mix(color, style_of(layer, label).color,
                        label_cover(label, depth, is_edge, layer.outline_px, layer.slice_opacity));
    };
    return glm::mix(covered(place.other, 0.0, false), covered(place.label, depth_px, edge),
                    std::min(0.5 + depth_px, 1.0));
}

std::optional<SliceHit> Slices::hit(const LocalRay& ray, glm::dvec2 pixel) {
    double nearest = std::numeric_limits<double>::infinity();
    const SliceLayer* which = nullptr;
    for (const SliceLayer& slice : scene_.slices) {
        const auto t =
            plane_distance(rays_.local_point(slice.point_mm), glm::normalize(slice.normal), ray);
        if (t && *t >= 0.0 && *t < nearest &&
            within(ray.origin + *t * ray.step, rays_.last(), kSlack)) {
            nearest = *t;
            which = &slice;
        }
    }
    if (which == nullptr)
        return std::nullopt;
    const glm::dvec3 normal = glm::normalize(which->normal);
    SliceHit hit{nearest, slab_value(*which, normal, rays_.index_at(ray, nearest)), {}};
    hit.color = std::isnan(hit.value) ? scene_.background : color_(hit.value);
    const glm::dvec3 local_mm = ray.origin_mm + nearest * ray.direction;
    if (fused_)
        hit.color = with_fusion(local_mm, hit.color);
    const auto smooth = [](const LabelLayer& layer) { return layer.edges == LabelEdges::smooth; };
    if (sampler_.has_labels() && smooth(*scene_.labels))
        hit.color = with_smooth_labels(
            *scene_.labels, *data_.labels, [&](glm::dvec3 at) { return rays_.label_index(at); },
            *which, normal, pixel, local_mm, hit.color);
    else if (sampler_.has_labels())
        hit.color = with_labels(
            *scene_.labels, [&](glm::dvec3 at) { return sampler_.shown_label(at); }, *which, normal,
            pixel, local_mm, hit.color);
    if (scene_.overlay && smooth(*scene_.overlay))
        hit.color = with_smooth_labels(
            *scene_.overlay, *data_.overlay,
            [&](glm::dvec3 at) {
                return index_point(data_.overlay->grid(),
                                   at + glm::dvec3(data_.volume.grid().world_from_index[3]));
            },
            *which, normal, pixel, local_mm, hit.color);
    else if (scene_.overlay)
        hit.color = with_labels(
            *scene_.overlay, [&](glm::dvec3 at) { return overlay_at(at); }, *which, normal, pixel,
            local_mm, hit.color);
    return hit;
}

} // namespace palpate::reference
