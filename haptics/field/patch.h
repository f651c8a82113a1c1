#pragma once

#include <array>

#include "engine/surface/local_surface.h"
#include "haptics/field/algorithm.h"
#include "haptics/field/fine_samples.h"
#include "haptics/field/rigid_space.h"
#include "haptics/field/triangles.h"

namespace palpate::haptics {

// The marching-cubes surface about a point, from bricks in memory, with the transfer function
// applied first. In mesh space: the volume's axes in millimetres (engine/mesh/mesh.h). Allocates
// nothing after it is made.
class Patch {
 public:
    static constexpr int kMostSide = 9;
    explicit Patch(uint32_t side) : side_(static_cast<int>(side)), surface_(side) {}

    // The window of side^3 samples whose middle is nearest to a world point.
    void extract(const Volume& volume, glm::dvec3 world_mm, const TouchParameters& parameters);

    // The same with the points of a finer lattice for samples, and as many of these; triangles
    // bulge, and lie in `space`. side >= 6. There are no normals until shade() makes them, which
    // takes three times as many points. Returns how many points it took.
    int64_t extract(FineSamples& samples, const Volume& volume, glm::dvec3 world_mm,
                    const RigidSpace& space);
    // Normals of the smooth view for that, once; `samples` as they were. Returns how many points it
    // took.
    int64_t shade(FineSamples& samples, const RigidSpace& space);

    bool is_empty() const { return span_.triangles.empty(); }
    const TriangleSpan& span() const { return span_; }
    glm::dvec3 low_mm() const { return low_; } // of the window, mesh space
    glm::dvec3 high_mm() const { return high_; }
    bool is_solid_amid() const { return is_solid_amid_; } // the middle of the window

    static glm::dmat4 mesh_from_world(const Volume& volume);

    // Moves every vertex to the mean of itself and its neighbours in the window, once.
    void mean_filter();

 private:
    TriangleCells sort_into_cells(std::span<const glm::vec3> positions, glm::dvec3 spacing,
                                  const glm::dmat3& mesh_from);
    static constexpr size_t kMostPositions = 3 * kMostSide * kMostSide * (kMostSide - 1); // edges
    int side_;
    LocalSurface surface_;
    TriangleSpan span_;
    LocalSurface::Patch made_; // in mesh space; what shade() goes by
    glm::ivec3 first_point_{0};
    glm::dvec3 spacing_{1.0};
    glm::dvec3 low_{0.0}, high_{0.0};
    bool is_solid_amid_ = false;
    std::array<float, kMostSide * kMostSide * kMostSide> samples_;
    std::array<glm::vec3, kMostPositions> filtered_, normals_;
    std::array<float, kMostPositions> weights_;
    // Triangles in the order of the cells that they lie in.
    static constexpr int kMostCells = (kMostSide - 1) * (kMostSide - 1) * (kMostSide - 1);
    std::array<uint32_t, kMostCells + 1> first_;
    std::array<glm::uvec3, 5 * kMostCells> sorted_; // marching cubes makes five of a cell at most
    std::array<uint16_t, 5 * kMostCells> cell_;
};

} // namespace palpate::haptics
