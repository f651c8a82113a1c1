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

    // |cosine| between the ray and the normal by central differences; 1 where there is no normal.
    double facing(const LocalRay& ray, double t);

    // Blinn-Phong with the light at the eye, so that light, view and half vector are one; clamped
    // to 0 .. 1.
    static glm::dvec3 lit(const Shading& shading, glm::dvec3 color, double facing);

    Tint tint(const LocalRay& ray, double t);

    // The label there, from the nearest voxel; 0 outside the label map, or for labels not shown.
    uint32_t shown_label(glm::dvec3 local_mm) const;
    LabelStyle style(uint32_t label) const { return style_of(*scene_.labels, label); }
    bool has_labels() const { return scene_.labels && data_.labels; }

 private:
    uint32_t label(glm::dvec3 local_mm) const;

    const Scene& scene_;
    const SceneData& data_;
    const Rays& rays_;
    SampleCursor values_;
    SampleCursor neighbours_; // of its own, so that gradients do not evict the ray's cell
};

} // namespace palpate::reference
