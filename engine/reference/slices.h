#pragma once

#include <functional>
#include <optional>

#include "engine/reference/sampler.h"

namespace palpate::reference {

// The slice that a ray meets first.
struct SliceHit {
    double t;     // mm along the ray
    double value; // of the volume there; NaN where there is no data
    glm::dvec3 color;
};

// All slices of a scene, for one thread. `color` turns a value into its grey or colour.
class Slices {
 public:
    // All must outlive it.
    Slices(const Scene& scene, const SceneData& data, const Rays& rays, const Sampler& sampler,
           std::function<glm::dvec3(double)> color);

    // The nearest slice at or beyond the ray's start and inside the sampled box, if any. `pixel` is
    // the one that the ray goes through.
    std::optional<SliceHit> hit(const LocalRay& ray, glm::dvec2 pixel);

 private:
    double slab_value(const SliceLayer& slice, glm::dvec3 normal, glm::dvec3 index);
    double value_at(const SliceLayer& slice, glm::dvec3 index);
    glm::dvec3 with_fusion(glm::dvec3 local_mm, glm::dvec3 color);
    // `shown` is the label at a point in mm, 0 for none.
    template <class Shown>
    glm::dvec3 with_labels(const LabelLayer& layer, const Shown& shown, const SliceLayer& slice,
                           glm::dvec3 normal, glm::dvec2 pixel, glm::dvec3 local_mm,
                           glm::dvec3 color) const;
    uint32_t overlay_at(glm::dvec3 local_mm) const; // shown there
    // With smooth edges. `to_index` and the labels are those of the map.
    glm::dvec3 with_smooth_labels(const LabelLayer& layer, const Volume& labels,
                                  const std::function<glm::dvec3(glm::dvec3 local_mm)>& to_index,
                                  const SliceLayer& slice, glm::dvec3 normal, glm::dvec2 pixel,
                                  glm::dvec3 local_mm, glm::dvec3 color) const;

    const Scene& scene_;
    const SceneData& data_;
    const Rays& rays_;
    const Sampler& sampler_;
    std::function<glm::dvec3(double)> color_;
    SampleCursor cursor_;
    struct Fused { // a volume over the slices
        SampleCursor cursor;
        TransferTable table;
    };
    std::optional<Fused> fused_;
};

// Catmull-Rom interpolation over 4x4x4 samples, those beyond the volume repeating its faces.
double catmull_rom(const Volume& volume, glm::dvec3 index);

} // namespace palpate::reference
