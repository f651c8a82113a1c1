#pragma once

#include <cstdint>

#include "engine/mesh/mesh.h"

namespace palpate {

struct PieceChoice {
    bool largest_only = false;
    double least_mm3 = 0.0; // smaller pieces go

    friend bool operator==(const PieceChoice&, const PieceChoice&) = default;
};

struct Pieces {
    Mesh mesh;
    uint64_t kept = 0, dropped = 0;
};

// The chosen pieces of a closed mesh. A piece is what common vertices join; its size is the volume
// that its surface encloses, holes and hollows in it included. The surface of a hollow is a piece,
// too: it stays where it is large enough, and goes with `largest_only`, which leaves one surface,
// so that the hollows in it are filled. Triangles and positions keep their order, labels and
// normals.
Pieces keep_pieces(const Mesh& mesh, const PieceChoice& choice);

} // namespace palpate
