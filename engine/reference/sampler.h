#pragma once

#include <optional>

#include "engine/reference/rays.h"
#include "engine/volume/sample.h"

namespace palpate::reference {

// How a label colours what is seen through it.
struct Tint {
    glm::dvec3 color{0.0};
    double weight = 0.0; // 0 for background
    bool visible = true;
};

// Values, light and labels at points of rays. For one thread.
class Sampler {
 public:
    // All must outlive it.
    Sampler(const Scene& scene, const SceneData& data, const Rays& rays);

    // The trilinear value at distance t; NaN where there is no data.
    double value(const LocalRay& ray, double t) { return values_.value(rays_.index_at(ray, t)); }

    // Blinn-Phong with the light at the eye, so that light, view and half vector are one; clamped
    // to 0 .. 1. `facing` is the |cosine| between ray and normal.
    static glm::dvec3 lit(const Shading& shading, glm::dvec3 color, double facing);

    // Blinn-Phong with the scene's light and the normal by central differences, which faces the eye
    // where there is none; of an iso-surface with ambient occlusion; of what a clip plane cuts.
    glm::dvec3 lit_at(const Shading& shading, glm::dvec3 color, const LocalRay& ray, double t);
    glm::dvec3 lit_surface(const Shading& shading, glm::dvec3 color, const LocalRay& ray, double t,
                           double iso);
    glm::dvec3 lit_cut(const Shading& shading, glm::dvec3 color, const LocalRay& ray,
                       const Stretch& t) const;

    // How open the iso-surface is at distance t, 0 .. 1: see RayCastLayer::occlusion_mm.
    double openness(const LocalRay& ray, double t, double iso);

    Tint tint(const LocalRay& ray, double t);

    // The label there, from the nearest voxel; 0 outside the label map, or for labels not shown.
    uint32_t shown_label(glm::dvec3 local_mm) const;
    LabelStyle style(uint32_t label) const { return style_of(*scene_.labels, label); }
    bool has_labels() const { return scene_.labels && data_.labels; }

 private:
    glm::dvec3 gradient_at(const LocalRay& ray, double t); // world, value units per mm
    glm::dvec3 lit_by(const Shading& shading, glm::dvec3 color, glm::dvec3 normal,
                      glm::dvec3 direction) const;
    double freedom_at(glm::dvec3 local_mm, double iso, double rise, double slope);
    uint32_t label(glm::dvec3 local_mm) const;

    const Scene& scene_;
    const SceneData& data_;
    const Rays& rays_;
    std::optional<glm::dvec3> light_; // towards it, where it is not at the eye
    double occlusion_mm_ = 0.0;
    SampleCursor values_;
    SampleCursor neighbours_; // of its own, so that gradients do not evict the ray's cell
};

} // namespace palpate::reference
