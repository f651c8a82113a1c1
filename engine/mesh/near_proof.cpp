#include "engine/mesh/near_proof.h"

namespace palpate {

// Planes tell most corners apart: one that is farther from the triangle's plane, or beyond one of
// its sides, is too far, and one over the triangle is as far as from its plane. Others are
// measured, and all where the triangle is so thin that rounding turns its normal.
bool NearProof::is_near(const Piece& piece, const Corners& other, double enough) {
    const glm::dvec3 u = other[1] - other[0], v = other[2] - other[0], w = other[2] - other[1];
    const glm::dvec3 normal = glm::cross(u, v);
    const double square = glm::dot(normal, normal), most = enough * enough;
    const bool has_plane = square > 1e-12 * glm::dot(u, u) * glm::dot(v, v);
    const Corners inward{glm::cross(normal, u), glm::cross(normal, w), glm::cross(v, normal)};
    for (size_t i = 0; i < piece.count; ++i) {
        const glm::dvec3 corner = piece.corners[i];
        bool is_over = has_plane;
        if (has_plane) {
            const double height = glm::dot(normal, corner - other[0]);
            if (height * height > most * square)
                return false;
            for (size_t k = 0; k < 3; ++k)
                if (const double depth = glm::dot(inward[k], corner - other[k]); depth < 0.0) {
                    if (depth * depth > most * glm::dot(inward[k], inward[k]))
                        return false;
                    is_over = false;
                }
        }
        if (!is_over && !(distance_to(other, corner) <= enough))
            return false;
    }
    return true;
}

// Whether a corner lies farther than half of `mm` beyond a plane.
bool NearProof::reaches_beyond(const Piece& piece, glm::dvec3 inward, glm::dvec3 side, double mm) {
    const double most = 0.25 * mm * mm * glm::dot(inward, inward);
    for (size_t i = 0; i < piece.count; ++i)
        if (const double depth = glm::dot(inward, piece.corners[i] - side);
            depth < 0.0 && depth * depth > most)
            return true;
    return false;
}

glm::dvec3 NearProof::centre(const Piece& piece) {
    glm::dvec3 sum(0.0);
    for (size_t i = 0; i < piece.count; ++i)
        sum += piece.corners[i];
    return sum / double(piece.count);
}

// The parts of a piece on either side of a plane.
void NearProof::split(const Piece& piece, glm::dvec3 normal, glm::dvec3 point, Piece& front,
                      Piece& back) {
    front.count = back.count = 0;
    const auto add = [](Piece& to, glm::dvec3 corner) {
        if (to.count < Piece::kMost)
            to.corners[to.count++] = corner;
    };
    double height = glm::dot(normal, piece.corners[piece.count - 1] - point);
    for (size_t i = 0; i < piece.count; ++i) {
        const glm::dvec3 before = piece.corners[(i + piece.count - 1) % piece.count];
        const double next = glm::dot(normal, piece.corners[i] - point);
        if ((height < 0.0) != (next < 0.0)) {
            const glm::dvec3 cut = glm::mix(before, piece.corners[i], height / (height - next));
            add(front, cut);
            add(back, cut);
        }
        add(next < 0.0 ? back : front, piece.corners[i]);
        height = next;
    }
}

// Cuts a piece across, between its centre's two sides of its longest side.
void NearProof::bisect(const Piece& piece, glm::dvec3 at) {
    glm::dvec3 longest(0.0);
    for (size_t i = 0; i < piece.count; ++i)
        if (const glm::dvec3 side = piece.corners[(i + 1) % piece.count] - piece.corners[i];
            glm::dot(side, side) > glm::dot(longest, longest))
            longest = side;
    Piece front{.near = piece.near}, back{.near = piece.near};
    split(piece, longest, at, front, back);
    for (const Piece& part : {front, back})
        if (part.count >= 3)
            pieces_.push_back(part);
}

} // namespace palpate
