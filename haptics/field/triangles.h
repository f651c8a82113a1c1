#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace palpate::haptics {

// A lattice over triangles, so that those about a place are found. Cell c holds triangles first[c]
// to first[c + 1], x fastest: each stands in all cells that its box meets, or in the one that it
// lies in.
struct TriangleCells {
    glm::dmat3 cells_from_mm{1.0};
    glm::dvec3 offset{0.0};    // of a place in cells
    glm::ivec3 count{0};       // 0: no cells
    glm::ivec3 from{0}, to{0}; // those that are looked into, both inclusive
    std::span<const uint32_t> first;
};

// Triangles at hand, counter-clockwise from outside.
struct TriangleSpan {
    std::span<const glm::vec3> positions;
    std::span<const glm::vec3> normals; // one a position, unit length; may be empty
    std::span<const glm::uvec3> triangles;
    // Above 0: triangles bulge between their vertices as these normals say, by at most so much. See
    // SurfacePoint::curved.
    double bulge_mm = 0.0;
    TriangleCells cells; // without them every triangle is looked at
    // How many triangles may still be looked at: what repeats looks ends below 1. Null: any number.
    int64_t* looks_left = nullptr;
    bool is_spent() const { return looks_left && *looks_left <= 0; }
};

struct SurfacePoint {
    glm::dvec3 point{0.0};
    // Half way from there to the mean of its projections on the vertices' tangent planes: Phong
    // tessellation (Boubekeur & Alexa 2008). On an arc of radius r a chord c lies c^2 / 8r deep,
    // and half of that mean lies so much above it, but for (c / r)^2 / 8 of it. The same seen from
    // either triangle of an edge.
    glm::dvec3 curved{0.0};
    glm::dvec3 face_normal{0.0};   // of the triangle, unit length
    glm::dvec3 shaded_normal{0.0}; // normals of the vertices, blended; unit length: force shading
    double distance = 0.0;         // from what was asked
    bool found = false;
};

// The nearest point of all triangles: the plane's, clamped to edge or vertex by barycentric
// coordinates (Ericson, Real-Time Collision Detection, 5.1.5). Of triangles that are equally near,
// the one that p sees most squarely. None where none is within_mm.
SurfacePoint nearest_point(const TriangleSpan& surface, glm::dvec3 p, double within_mm = INFINITY);

// Finds the point where a segment first passes a triangle from outside to inside. Edges and corners
// belong to all of their triangles, so that a closed surface has no gap for any rounding. A
// triangle that the start lies behind by no more than `behind` is passed there. distance is from
// `from`, and below 0 for those.
SurfacePoint first_crossing(const TriangleSpan& surface, glm::dvec3 from, glm::dvec3 to,
                            double behind = 0.0);

} // namespace palpate::haptics
