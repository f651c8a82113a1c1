#include "engine/mesh/near_proof.h"

namespace palpate {

bool NearProof::is_near(const Piece& piece, const Corners& other, double enough) {
    for (size_t i = 0; i < piece.count; ++i)
        if (!(distance_to(other, piece.corners[i]) <= enough))
            return false;
    return true;
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
