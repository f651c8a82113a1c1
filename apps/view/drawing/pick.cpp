#include "apps/view/drawing/pick.h"

#include <cmath>

#include "engine/scene/least_value.h"
#include "engine/volume/extent.h"
#include "engine/volume/sample.h"

namespace palpate::view {

namespace {

struct Span {
    double begin = 0.0, end = INFINITY;
    void keep(double along, double above) { // where along * t >= above
        if (along > 0.0)
            begin = std::max(begin, above / along);
        else if (along < 0.0)
            end = std::min(end, above / along);
        else if (above > 0.0)
            end = -INFINITY;
    }
};

} // namespace

namespace {

// Whether the nearest sample of a label map is of a label that a scene shows.
class ShownLabels {
 public:
    ShownLabels(const Volume* labels, const Scene& scene)
        : labels_(scene.labels ? labels : nullptr), layer_(scene.labels.value_or(LabelLayer{})) {
        if (!labels_)
            return;
        cursor_.emplace(*labels_);
        to_index_ = index_from_world(labels_->grid());
    }
    explicit operator bool() const { return labels_ != nullptr; }

    bool is_at(glm::dvec3 point_mm) {
        const glm::dvec3 index = glm::round(glm::dvec3(to_index_ * glm::dvec4(point_mm, 1.0)));
        const glm::dvec3 last = glm::dvec3(labels_->size()) - 1.0;
        if (glm::any(glm::lessThan(index, glm::dvec3(0.0))) ||
            glm::any(glm::greaterThan(index, last)))
            return false;
        const auto label = static_cast<uint32_t>(cursor_->value(index));
        if (label == 0)
            return false;
        const LabelStyle style = style_of(layer_, label);
        return style.visible && style.opacity > 0.0;
    }

 private:
    const Volume* labels_;
    LabelLayer layer_;
    std::optional<SampleCursor> cursor_;
    glm::dmat4 to_index_{1.0};
};

} // namespace

std::optional<glm::dvec3> first_seen(const Ray& ray, const Volume& volume, const Scene& scene,
                                     const Volume* labels) {
    ShownLabels shown(labels, scene);
    // At or above which value a surface is met, of rays or live.
    std::optional<double> wall;
    const auto add_wall = [&](double iso) { wall = std::min(iso, wall.value_or(iso)); };
    for (const SurfaceLayer& surface : scene.surfaces)
        if (surface.live_iso)
            add_wall(*surface.live_iso);
    if (!scene.ray_cast && !wall && !shown)
        return std::nullopt;
    const RayMode mode = scene.ray_cast ? scene.ray_cast->mode : RayMode::iso;
    if (scene.ray_cast && mode == RayMode::iso)
        add_wall(scene.ray_cast->isos.front().value);
    Span span;
    for (const HalfSpace& side : half_spaces(volume.grid()))
        span.keep(glm::dot(side.normal, ray.direction),
                  side.offset - glm::dot(side.normal, ray.origin_mm));
    for (const ClipPlane& plane : scene.clip_planes)
        span.keep(glm::dot(plane.normal, ray.direction),
                  glm::dot(plane.normal, plane.point_mm - ray.origin_mm));
    if (!(span.begin < span.end))
        return std::nullopt;
    const glm::dmat4 to_index = index_from_world(volume.grid());
    SampleCursor cursor(volume);
    const auto place = [&](double t) { return ray.origin_mm + t * ray.direction; };
    const auto value = [&](double t) {
        return double{cursor.value(glm::dvec3(to_index * glm::dvec4(place(t), 1.0)))};
    };
    const double step = 0.5 * smallest_spacing_mm(volume.grid());
    const double sign = scene.ray_cast && shows_least_value(scene.ray_cast->transfer) ? -1.0 : 1.0;
    double depth = 0.0, most = -INFINITY, most_at = NAN, last = NAN;
    for (double t = span.begin + 0.5 * step; t < span.end; t += step) {
        if (shown && shown.is_at(place(t)))
            return place(t);
        const double v = value(t);
        if (wall && v >= *wall) {
            double low = last < *wall ? t - step : t, high = t;
            while (high - low > 0.001 * step) {
                const double middle = 0.5 * (low + high);
                (value(middle) >= *wall ? high : low) = middle;
            }
            return place(high);
        }
        if (mode == RayMode::mip) {
            if (sign * v > most) {
                most = sign * v;
                most_at = t;
            }
        } else if (mode == RayMode::alpha && !std::isnan(v)) {
            depth += tau_per_mm_at(scene.ray_cast->transfer, v) * step;
            if (depth >= std::log(2.0))
                return place(t);
        }
        last = v;
    }
    return std::isnan(most_at) ? std::nullopt : std::optional(place(most_at));
}

} // namespace palpate::view
