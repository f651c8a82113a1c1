#pragma once

#include <glm/glm.hpp>
#include <span>

#include "engine/surface/block_mesh.h"
#include "engine/volume/volume.h"

namespace palpate {

// The surface in a small cube of samples, made again at every tick of a hand: Koerner et al.,
// "Haptic volume rendering with an intermediate local representation" (1999), where it is 7^3.
//
// Everything is allocated by the constructor; extract() allocates nothing, takes no lock and does
// not throw, unless bricks lie in a source (see Volume), and is bounded by the size of the window.
// For one thread. The result is valid until the next call.
class LocalSurface {
 public:
    static constexpr uint32_t kMostSamples = 9; // on each axis of a window

    // side: samples on each axis of the window, 2 .. 9.
    explicit LocalSurface(uint32_t side = 7, SurfaceTopology topology = SurfaceTopology::classic);

    uint32_t side() const { return side_; }

    struct Patch {
        std::span<const glm::vec3> positions; // mm, mesh space (see world_from_mesh())
        std::span<const glm::vec3> normals;   // unit, outward, against the gradient
        std::span<const glm::uvec3> triangles;
        glm::ivec3 first_sample{0}; // of the window
    };

    // The window of the volume whose middle lies nearest to `index` (index space), moved inward
    // where it would reach beyond the volume; smaller where the volume is. Gradients read the
    // samples about the window, so that vertices are those of marching_cubes(), bit for bit. An
    // index that is not finite gives nothing.
    Patch extract(const Volume& volume, glm::dvec3 index, float iso);

    // A window of side^3 samples, x fastest; NaN is no data. Its first sample lies at origin_mm,
    // axes are those of mesh space. Gradients repeat the outermost samples.
    Patch extract(std::span<const float> samples, glm::vec3 spacing_mm, glm::vec3 origin_mm,
                  float iso);

 private:
    uint32_t side_;
    SurfaceTopology topology_;
    block::BlockMesher mesher_;
    std::vector<glm::vec3> moved_; // positions from origin_mm
};

} // namespace palpate
