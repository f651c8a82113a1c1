#pragma once

#include <optional>
#include <vector>

#include "engine/reference/march.h"

namespace palpate::reference {

// A triangle or a cap as one ray sees it.
struct SurfaceHit {
    double t;         // mm along the ray
    glm::dvec3 color; // lit
    double opacity;
    double value; // the label, or NaN

    Marched marched() const;
};

// The intersections of a ray with a scene's meshes.
struct SurfaceHits {
    std::vector<SurfaceHit> see_through; // in order, those before `opaque`
    std::optional<SurfaceHit> opaque;    // the nearest
};

// All meshes of a scene that has no live surfaces: give their meshes instead. Every ray is tried
// against every triangle.
class Surfaces {
 public:
    // All must outlive it.
    Surfaces(const Scene& scene, const SceneData& data, const Rays& rays);

    SurfaceHits along(const LocalRay& ray) const;

 private:
    struct Triangle {
        glm::dvec3 a, b, c; // local mm, sorted: coinciding triangles are met alike
        glm::dvec3 center;  // of a sphere round it
        double radius_squared;
        bool swapped; // sorting has turned it round
        uint32_t mesh, number;
        uint32_t label, outer; // 0 is background
    };
    struct Crossing {
        double t;
        bool leaving; // from the inside out
        const Triangle* triangle;
    };
    void add_mesh(uint32_t mesh);
    std::optional<Crossing> cross(const LocalRay& ray, const Triangle& triangle) const;
    SurfaceHit seen(const LocalRay& ray, const Crossing& crossing) const;
    SurfaceStyle style(uint32_t mesh, uint32_t label) const;
    void add_cap(const LocalRay& ray, double t, glm::dvec3 normal,
                 const std::vector<Crossing>& crossings, std::vector<SurfaceHit>& hits) const;

    const Scene& scene_;
    const SceneData& data_;
    const Rays& rays_;
    std::vector<Triangle> triangles_;
    std::vector<bool> mirrored_, labelled_;      // meshes
    std::vector<glm::dmat3> covector_from_mesh_; // turns normals into the world
};

} // namespace palpate::reference
