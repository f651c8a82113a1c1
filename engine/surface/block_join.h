#pragma once

#include <span>

#include "engine/surface/block_mesh.h"

namespace palpate::block {

// A block's mesh, and where the block lies: (0, 0, 0) begins with sample (0, 0, 0).
struct PlacedBlock {
    glm::ivec3 at;
    const BlockMesh* mesh;
};

// Whether block `a` comes before block `b` in a mesh: brick by brick, block by block within.
bool comes_before(glm::ivec3 a, glm::ivec3 b);

// One mesh with shared vertices: what marching_cubes() makes of the volume whose blocks these are.
// `blocks` are all those with a surface, in the order of comes_before().
Mesh join_blocks(const Grid& grid, const SurfaceOptions& options,
                 std::span<const PlacedBlock> blocks);

} // namespace palpate::block
