#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/mesh/mesh.h"

namespace palpate {

// The triangles of a mesh in world millimetres, in a tree of boxes that finds the nearest one.
//
// A balanced binary tree: each node halves its triangles by their centres along the longest side of
// its box. The same mesh gives the same tree and the same answers on any number of threads.
class TriangleTree {
 public:
    // Every corner of every triangle must be a position; flat and degenerate triangles may be.
    explicit TriangleTree(const Mesh& mesh);

    struct Nearest {
        double distance_mm = std::numeric_limits<double>::infinity();
        glm::dvec3 point_mm{};
        uint32_t triangle = ~0u; // of the mesh; ~0u where there is none
    };
    // The nearest point of all triangles; of several equally near, any one. Infinitely far, and no
    // triangle, where none is nearer than within_mm.
    Nearest nearest(glm::dvec3 point_mm,
                    double within_mm = std::numeric_limits<double>::infinity()) const;

    // Corners of triangle `n` of the mesh, world millimetres.
    std::array<glm::dvec3, 3> corners(uint32_t n) const {
        const glm::uvec3 t = triangles_[n];
        return {positions_[t.x], positions_[t.y], positions_[t.z]};
    }
    glm::uvec3 triangle(uint32_t n) const { return triangles_[n]; }
    uint32_t triangle_count() const { return static_cast<uint32_t>(triangles_.size()); }
    const std::vector<glm::dvec3>& positions_mm() const { return positions_; }

    // Unit normal of a triangle, on the side that is outside; (0, 0, 0) for a flat one.
    glm::dvec3 normal(uint32_t n) const;

 private:
    struct Box {
        glm::dvec3 low{std::numeric_limits<double>::infinity()};
        glm::dvec3 high{-std::numeric_limits<double>::infinity()};
    };
    void build(size_t node, uint32_t begin, uint32_t end, uint32_t level,
               const std::vector<glm::dvec3>& centers);
    void search(size_t node, uint32_t begin, uint32_t end, uint32_t level, glm::dvec3 point,
                Nearest& best) const;

    std::vector<glm::dvec3> positions_;
    std::vector<glm::uvec3> triangles_;
    std::vector<uint32_t> order_; // triangles; node k at level l has an even share of them
    std::vector<Box> boxes_;      // of node k; its halves are nodes 2k + 1 and 2k + 2
    uint32_t levels_ = 0;         // below the root
    bool mirrored_ = false;
};

// The point of a triangle nearest to `p` (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
glm::dvec3 nearest_point(glm::dvec3 p, const std::array<glm::dvec3, 3>& triangle);

} // namespace palpate
