#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/mesh/triangle_tree.h"

namespace palpate {

using Corners = std::array<glm::dvec3, 3>; // of a triangle

// Whether it names one vertex twice.
inline bool is_degenerate(glm::uvec3 triangle) {
    return triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x;
}

inline glm::dvec3 twice_area_normal(const Corners& c) {
    return glm::cross(c[1] - c[0], c[2] - c[0]);
}

inline double distance_to(const Corners& triangle, glm::dvec3 point) {
    return glm::length(point - nearest_point(point, triangle));
}

// Proves that all points of a triangle are near another surface, not samples of them alone.
//
// The triangle is cut along the other surface's edges, until each piece lies near one of its
// triangles: the distance to one triangle is a convex function, so the piece's corners speak for
// the piece. A proof keeps its memory for the next.
class NearProof {
 public:
    static constexpr uint32_t kNone = ~0u;
    static constexpr double kSlack = 1.1; // levels that all points lie within
    static constexpr double kStep = 1.1;  // levels rise by at least this factor

    struct Piece { // a convex part of a triangle
        static constexpr size_t kMost = 12;
        std::array<glm::dvec3, kMost> corners;
        size_t count = 0;
        std::array<uint32_t, 3> near{kNone, kNone, kNone}; // of the other surface
    };
    struct Found {
        uint32_t triangle;
        double distance_mm;
    };

    // Returns at most `level` if all points of `whole` are within kSlack levels of the other
    // surface, else the distance of a point that is too far or, if none was found in time, the next
    // level. corners_of(n) is a triangle of the other surface; nearest_to(point, near) is Found,
    // its nearest one, given some triangles near by, of which any may be kNone.
    template <class CornersOf, class NearestTo>
    double prove(const Piece& whole, double level, const CornersOf& corners_of,
                 const NearestTo& nearest_to);

 private:
    static constexpr size_t kMostPieces = 64;
    static bool is_near(const Piece& piece, const Corners& other, double enough);
    static bool reaches_beyond(const Piece& piece, glm::dvec3 inward, glm::dvec3 side, double mm);
    static glm::dvec3 centre(const Piece& piece);
    static void split(const Piece& piece, glm::dvec3 normal, glm::dvec3 point, Piece& front,
                      Piece& back);
    void bisect(const Piece& piece, glm::dvec3 at);
    std::vector<Piece> pieces_;
};

template <class CornersOf, class NearestTo>
double NearProof::prove(const Piece& whole, double level, const CornersOf& corners_of,
                        const NearestTo& nearest_to) {
    const double enough = kSlack * level;
    const auto is_near_hint = [&](const Piece& piece) {
        for (size_t k = 0; k < 3; ++k)
            if (const uint32_t n = piece.near[k]; n != kNone && (k == 0 || n != piece.near[0]) &&
                                                  (k < 2 || n != piece.near[1]) &&
                                                  is_near(piece, corners_of(n), enough))
                return true;
        return false;
    };
    pieces_.assign(1, whole);
    for (size_t looks = 0; !pieces_.empty(); ++looks) {
        const Piece piece = pieces_.back();
        pieces_.pop_back();
        if (is_near_hint(piece))
            continue;
        const Found found = nearest_to(centre(piece), piece.near);
        if (found.distance_mm > level)
            return found.distance_mm;
        if (looks > kMostPieces || piece.count >= Piece::kMost - 3)
            return kStep * level;
        // The part over the triangle nearest to the middle, and the rest.
        const Corners other = corners_of(found.triangle);
        const glm::dvec3 normal = twice_area_normal(other);
        const size_t others = pieces_.size();
        Piece over = piece, inside, outside;
        over.near = {found.triangle, kNone, kNone};
        for (size_t k = 0; k < 3 && over.count >= 3; ++k) {
            const glm::dvec3 inward = glm::cross(normal, other[(k + 1) % 3] - other[k]);
            if (!reaches_beyond(over, inward, other[k], enough))
                continue;
            split(over, inward, other[k], inside, outside);
            inside.near = outside.near = over.near;
            over = inside;
            if (outside.count >= 3)
                pieces_.push_back(outside);
        }
        if (over.count < 3) {
            pieces_.resize(others);
            over = piece;
        } else if (is_near(over, other, enough)) {
            continue;
        }
        for (size_t i = 0; i < over.count; ++i)
            if (distance_to(other, over.corners[i]) > enough)
                if (const double d = nearest_to(over.corners[i], over.near).distance_mm; d > enough)
                    return d;
        bisect(over, centre(over));
    }
    return level;
}

} // namespace palpate
