#pragma once

#include "engine/reference/sampler.h"

namespace palpate::reference {

// Colour and transmittance along a ray.
struct Marched {
    glm::dvec3 color{0.0};      // weighted by opacity
    double transmittance = 1.0; // of what lies behind
    double value;               // MIP: the maximum; iso: the value of the first surface; else NaN
    double depth;               // iso: distance of the first surface in mm; else NaN

    Marched();
    void add(glm::dvec3 sample_color, double opacity) {
        color += transmittance * opacity * sample_color;
        transmittance *= 1.0 - opacity;
    }
    // Puts `behind` behind this; value and depth stay those of the first that has any.
    void then(const Marched& behind);
};

// The ray caster's algorithm (engine/scene/scene.h, RayCastLayer), in double. `table` belongs to
// layer.transfer; step_mm > 0.
class Marcher {
 public:
    // All must outlive it.
    Marcher(const RayCastLayer& layer, const TransferTable& table, double step_mm,
            Sampler& sampler);

    // `t` is not empty.
    Marched march(const LocalRay& ray, Stretch t);

 private:
    struct Segment {
        double from, to, middle;
        double length() const { return to - from; }
    };
    // Calls visit(segment) for the lattice's segments cut to `t`, until it returns false.
    template <class Visit>
    void for_each_segment(Stretch t, Visit&& visit) const;

    Marched march_alpha(const LocalRay& ray, Stretch t);
    Marched march_mip(const LocalRay& ray, Stretch t);
    Marched march_iso(const LocalRay& ray, Stretch t);

    // Means over a segment: rgb and tau per mm. Tau is 0 where there is no data.
    glm::dvec4 mean_of(const LocalRay& ray, const Segment& segment);
    double crossing(const LocalRay& ray, glm::dvec2 a, glm::dvec2 b, double iso);

    const RayCastLayer& layer_;
    const TransferTable& table_;
    double step_mm_;
    Sampler& sampler_;
};

// How many iso-values a value reaches; 0 for NaN.
size_t level_of(const std::vector<IsoSurface>& isos, double value);

// The table's entry nearest to a value: rgb and tau per mm.
glm::dvec4 nearest_entry(const TransferTable& table, double value);

// Means of color (weighted by tau) and tau over the values between `a` and `b`; the nearest entry
// at their middle where they are less than one entry apart.
glm::dvec4 mean_entry(const TransferTable& table, double a, double b);

} // namespace palpate::reference
