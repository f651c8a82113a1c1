#include "engine/reference/sampler.h"

#include <cmath>

namespace palpate::reference {

Sampler::Sampler(const Scene& scene, const SceneData& data, const Rays& rays)
    : scene_(scene), data_(data), rays_(rays), values_(data.volume), neighbours_(data.volume) {}

double Sampler::facing(const LocalRay& ray, double t) {
    const glm::dvec3 gradient =
        world_gradient(data_.volume.grid(), neighbours_.gradient(rays_.index_at(ray, t)));
    const double length = glm::length(gradient);
    if (!(length > 0.0)) // also where a neighbour has no data
        return 1.0;
    return std::min(std::abs(glm::dot(gradient, ray.direction)) / length, 1.0);
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
    if (!has_labels())
        return {};
    const uint32_t found = label(ray.origin_mm + t * ray.direction);
    if (found == 0)
        return {};
    const LabelStyle look = style(found);
    return {look.color, scene_.labels->ray_cast_weight, look.visible};
}

} // namespace palpate::reference
