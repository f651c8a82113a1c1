#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace palpate::reference {

// A ray in two spaces at once. Distances along it are millimetres from its start in both.
struct LocalRay {
    glm::dvec3
        origin_mm; // local: world millimetres from the centre of the volume's sample (0, 0, 0)
    glm::dvec3 direction; // local; unit length
    glm::dvec3 origin;    // index space
    glm::dvec3 step;      // index space, per millimetre
};

// From `from` to `to` millimetres along a ray; empty unless from < to.
struct Stretch {
    double from = 0.0, to = 0.0;
    // |cosine| between the ray and the normal of the clip plane that `from` lies on; 0 for none.
    double cut = 0.0;
    glm::dvec3 cut_normal{0.0}; // of that plane, local, of any length
    bool empty() const { return !(from < to); }
};

// One eye's rays through one volume, in double. Everything is taken relative to the volume's origin
// first, so that a scene far from the world's origin gives the same bits.
class Rays {
 public:
    // eye: 0 (mono, left) or 1 (right, for scenes with stereo).
    Rays(const Scene& scene, const SceneData& data, int eye);

    // pixel may be fractional; pixel + 0.5 is the point of the picture it goes through.
    LocalRay through(glm::dvec2 pixel) const;

    // The stretch of the ray inside the sampled box [0, size - 1] and all clip planes, at or beyond
    // its start.
    Stretch inside(const LocalRay& ray) const;

    // The point at distance t in index space, moved into the sampled box where rounding has left
    // it.
    glm::dvec3 index_at(const LocalRay& ray, double t) const {
        return glm::clamp(ray.origin + t * ray.step, glm::dvec3(0.0), last_);
    }

    glm::dvec3 last() const { return last_; } // size - 1
    glm::dvec3 local_point(glm::dvec3 world_mm) const { return world_mm - origin_mm_; }
    const glm::dmat3& index_from_local() const { return index_from_local_; }

    // Index space of the label map, from local millimetres: scale * local + offset.
    glm::dvec3 label_index(glm::dvec3 local_mm) const {
        return label_from_local_ * local_mm + label_offset_;
    }
    glm::dvec3 label_step(glm::dvec3 local_mm) const { return label_from_local_ * local_mm; }

 private:
    struct HalfSpace {
        glm::dvec3 point_mm, normal; // local
    };
    View view_;
    glm::uvec2 size_px_;
    glm::dvec3 origin_mm_, last_;
    glm::dmat3 index_from_local_;
    glm::dmat3 label_from_local_{0.0};
    glm::dvec3 label_offset_{0.0};
    std::vector<HalfSpace> clips_;
};

} // namespace palpate::reference
