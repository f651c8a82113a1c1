#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/surface/marching_cubes.h"
#include "engine/volume/changes.h"

// The blocks of a surface that an edit changes. Surfaces are kept in blocks of 8^3 samples, on the
// CPU or the GPU. Block (0, 0, 0) begins with sample (0, 0, 0).
namespace palpate::block {

// The blocks that read a changed sample, in rising order of z, y, x, each once: a block reads its
// own samples, the next two beyond (one without gradient normals), and the one before it (none
// without). `changed` is what changed_bricks() gives for the two snapshots; blocks are kept that
// lie in [first, end) on every axis.
std::vector<glm::ivec3> blocks_that_read(const Volume& before, const Volume& after,
                                         std::span<const ChangedBrick> changed,
                                         const SurfaceOptions& options, glm::ivec3 first,
                                         glm::ivec3 end);

// By the ranges of blocks alone: all samples that the cells of a block within an open volume read
// lie on one side of iso.
bool is_on_one_side(const Volume& volume, float iso, glm::ivec3 block);

// The block with this number in its brick, counted as block_of() does.
glm::ivec3 block_in_brick(int number);

} // namespace palpate::block
