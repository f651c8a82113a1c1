#include "engine/reference/sampler.h"

#include <cmath>

namespace palpate::reference {

Sampler::Sampler(const Scene& scene, const SceneData& data, const Rays& rays)
    : scene_(scene), data_(data), rays_(rays), values_(data.volume), neighbours_(data.volume) {
    if (!scene.ray_cast)
        return;
    occlusion_mm_ = scene.ray_cast->occlusion_mm;
    if (scene.ray_cast->light)
        light_ = towards(*scene.ray_cast->light, scene.camera);
}

glm::dvec3 Sampler::gradient_at(const LocalRay& ray, double t) {
    return world_gradient(data_.volume.grid(), neighbours_.gradient(rays_.index_at(ray, t)));
}

// `normal` is of any length and on either side; 0 or NaN where there is none.
glm::dvec3 Sampler::lit_by(const Shading& shading, glm::dvec3 color, glm::dvec3 normal,
                           glm::dvec3 direction) const {
    const double length = glm::length(normal);
    const bool has_normal = length > 0.0; // not where a neighbour has no data
    if (!light_)
        return lit(
            shading, color,
            has_normal ? std::min(std::abs(glm::dot(normal, direction)) / length, 1.0) : 1.0);
    glm::dvec3 n = -direction;
    if (has_normal)
        n = glm::dot(normal, direction) > 0.0 ? -normal / length : normal / length;
    const double to_light = glm::dot(n, *light_);
    const glm::dvec3 half = *light_ - direction;
    const double to_half = glm::dot(n, half) / std::max(glm::length(half), 1e-6);
    // Highlights fade in over the first eighth of the cosine, so that none begins at a jump.
    const double highlight = shading.specular * std::clamp(8.0 * to_light, 0.0, 1.0) *
                             std::pow(std::clamp(to_half, 0.0, 1.0), shading.shininess);
    const double diffuse = shading.ambient + shading.diffuse * std::max(to_light, 0.0);
    return glm::clamp(color * diffuse + highlight, 0.0, 1.0);
}

glm::dvec3 Sampler::lit_at(const Shading& shading, glm::dvec3 color, const LocalRay& ray,
                           double t) {
    return lit_by(shading, color, gradient_at(ray, t), ray.direction);
}

glm::dvec3 Sampler::lit_surface(const Shading& shading, glm::dvec3 color, const LocalRay& ray,
                                double t, double iso) {
    const glm::dvec3 seen = lit_at(shading, color, ray, t);
    return occlusion_mm_ > 0.0 ? openness(ray, t, iso) * seen : seen;
}

glm::dvec3 Sampler::lit_cut(const Shading& shading, glm::dvec3 color, const LocalRay& ray,
                            const Stretch& t) const {
    return light_ ? lit_by(shading, color, t.cut_normal, ray.direction)
                  : lit(shading, color, t.cut);
}

// `rise` is 1 where values below iso are free, -1 where those above are; slope in values per mm.
double Sampler::freedom_at(glm::dvec3 local_mm, double iso, double rise, double slope) {
    const double fall_mm = occlusion_mm_ / 16.0;
    const glm::dvec3 index = rays_.index_from_local() * local_mm;
    const double value = neighbours_.value(index); // NaN outside, too
    double free =
        std::isnan(value) ? 1.0 : std::clamp(rise * (iso - value) / (slope * fall_mm), 0.0, 1.0);
    for (const ClipPlane& plane : scene_.clip_planes) {
        const double kept_mm =
            glm::dot(glm::normalize(plane.normal), local_mm - rays_.local_point(plane.point_mm));
        free = std::max(free, std::clamp(-kept_mm / fall_mm, 0.0, 1.0));
    }
    return free;
}

double Sampler::openness(const LocalRay& ray, double t, double iso) {
    const glm::dvec3 gradient = gradient_at(ray, t);
    const double slope = glm::length(gradient);
    if (!(slope > 0.0))
        return 1.0;
    const double rise = glm::dot(gradient, ray.direction) > 0.0 ? 1.0 : -1.0;
    const glm::dvec3 normal = -rise / slope * gradient;
    const glm::dvec3 start = ray.origin_mm + t * ray.direction + occlusion_mm_ / 16.0 * normal;
    // The corners of a truncated cuboctahedron, one of each pair of opposites.
    const glm::dvec3 corner =
        glm::normalize(glm::dvec3(1.0, 1.0 + std::sqrt(2.0), 1.0 + 2.0 * std::sqrt(2.0)));
    constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                   {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    constexpr int kSteps = 8;
    double sum = 0.0, weights = 0.0;
    for (const auto& order : kOrders)
        for (const double x_sign : {1.0, -1.0})
            for (const double y_sign : {1.0, -1.0}) {
                glm::dvec3 axis(x_sign * corner[order[0]], y_sign * corner[order[1]],
                                corner[order[2]]);
                if (glm::dot(axis, normal) < 0.0)
                    axis = -axis;
                double free = 1.0, free_steps = 0.0;
                for (int k = 0; k < kSteps; ++k) {
                    const double away_mm = (k + 0.5) * occlusion_mm_ / kSteps;
                    free = std::min(free, freedom_at(start + away_mm * axis, iso, rise, slope));
                    free_steps += free;
                }
                sum += glm::dot(axis, normal) * free_steps / kSteps;
                weights += glm::dot(axis, normal);
            }
    return sum / weights;
}

glm::dvec3 Sampler::lit(const Shading& shading, glm::dvec3 color, double facing) {
    const double highlight = shading.specular * std::pow(facing, shading.shininess);
    return glm::clamp(color * (shading.ambient + shading.diffuse * facing) + highlight, 0.0, 1.0);
}

uint32_t Sampler::label(glm::dvec3 local_mm) const {
    const glm::dvec3 nearest = glm::floor(rays_.label_index(local_mm) + 0.5);
    const glm::dvec3 size(data_.labels->size());
    for (int axis = 0; axis < 3; ++axis)
        if (!(nearest[axis] >= 0.0 && nearest[axis] < size[axis]))
            return 0;
    return static_cast<uint32_t>(data_.labels->value(glm::uvec3(nearest)));
}

uint32_t Sampler::shown_label(glm::dvec3 local_mm) const {
    const uint32_t found = label(local_mm);
    return found != 0 && style(found).visible ? found : 0;
}

Tint Sampler::tint(const LocalRay& ray, double t) {
    if (!has_labels() || !(scene_.labels->ray_cast_weight > 0.0))
        return {};
    const uint32_t found = label(ray.origin_mm + t * ray.direction);
    if (found == 0)
        return {};
    const LabelStyle look = style(found);
    return {look.color, scene_.labels->ray_cast_weight, look.visible};
}

} // namespace palpate::reference
