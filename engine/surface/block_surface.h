#pragma once

#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "engine/surface/block_mesh.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace block {
class BlockReader;
}

// The surface of a volume that is being edited, kept block by block of 8^3 samples.
//
// update() makes again the blocks that read a changed sample, and no others: a block
// reads its own samples, the next two beyond (one without gradient normals), and the one
// before it (none without). mesh() always equals marching_cubes() of the newest snapshot,
// to the bit. Blocks share nothing, so that each can be drawn, uploaded or searched
// alone.
//
// Normals of SurfaceNormals::triangles are made by mesh(); blocks have none then. For one thread at
// a time; update() itself uses all cores where it pays.
class BlockSurface {
 public:
    BlockSurface(const Volume& volume, float iso, const SurfaceOptions& options = {});
    ~BlockSurface();
    BlockSurface(BlockSurface&&) noexcept;
    BlockSurface& operator=(BlockSurface&&) noexcept;

    const Volume& volume() const { return volume_; }
    float iso() const { return iso_; }
    const SurfaceOptions& options() const { return options_; }

    struct Update {
        // Blocks that were made again, in rising order of z, y, x; they may be empty. Block
        // (0, 0, 0) begins with sample (0, 0, 0); with a closed border there are blocks from
        // -1 on.
        std::vector<glm::ivec3> blocks;
        uint64_t triangles = 0; // in these blocks, now
    };
    // `after` has the size and type of volume(). The second form takes the list of changed_bricks()
    // for volume() and `after`, for callers that have it already.
    Update update(const Volume& after);
    Update update(const Volume& after, std::span<const ChangedBrick> changed);

    // Null where the block has no surface.
    const BlockMesh* block(glm::ivec3 position) const;
    // Positions of all blocks with a surface, in the order of the mesh.
    std::vector<glm::ivec3> blocks() const;
    uint64_t triangles() const { return triangles_; }

    // One mesh with shared vertices: the same as marching_cubes(volume(), iso(), options()).
    Mesh mesh() const;

 private:
    struct Worker;
    size_t slot(glm::ivec3 block) const;
    void remesh(std::span<const glm::ivec3> blocks);
    void remesh_one(glm::ivec3 block, block::BlockReader& reader, Worker& worker);

    Volume volume_;
    float iso_;
    SurfaceOptions options_;
    int lead_;                   // blocks before the volume: 1 if closed
    glm::ivec3 count_;           // of slots on each axis
    std::vector<uint32_t> mesh_; // of each slot: 1 + index into meshes_, or 0
    std::vector<BlockMesh> meshes_;
    std::vector<uint32_t> free_; // of meshes_
    std::vector<std::unique_ptr<Worker>> workers_;
    uint64_t triangles_ = 0;
};

} // namespace palpate
