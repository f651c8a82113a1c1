#pragma once

#include <memory>
#include <vector>

#include "engine/surface/block_cells.h"

namespace palpate {

// The surface within one block of 8^3 samples, complete in itself: vertices that a neighbour owns
// are here once more, with the same bits.
struct BlockMesh {
    std::vector<glm::vec3> positions; // mm, mesh space; first the own vertices, then the borrowed
    std::vector<glm::vec3> normals;   // none, or one a position
    std::vector<glm::uvec3> triangles;
    std::vector<uint16_t> edges; // own, then borrowed: block::edge_number() of each, rising in each
    uint32_t own_edges = 0;      // vertices on edges of the block's own samples; then
    uint32_t inner = 0;          // vertices within its cells; the rest are borrowed

    bool empty() const { return positions.empty() && triangles.empty(); }
};

namespace block {

// Meshes single blocks. All its memory is there from the start, apart from what is returned.
class BlockMesher {
 public:
    BlockMesher();

    Samples& samples(); // to be filled before each mesh()

    // The mesh of the block at `place`. Pointers stay valid until the next call.
    struct Result {
        int own_edges = 0, inner = 0, vertices = 0, triangles = 0;
        const glm::vec3* positions = nullptr; // own edges, inner, borrowed
        const glm::vec3* normals = nullptr;   // null without
        const glm::uvec3* triangle = nullptr;
        const uint16_t* edges = nullptr; // of own edges, then of borrowed ones
    };
    Result mesh(Last last, const Place& place, float iso, SurfaceTopology topology, bool normals);

 private:
    struct Work;
    struct Free {
        void operator()(Work* work) const;
    };
    std::unique_ptr<Work, Free> work_;
};

} // namespace block
} // namespace palpate
