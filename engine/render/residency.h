#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/camera.h"
#include "engine/volume/volume.h"

namespace palpate {

// How a volume lies on the GPU.
enum class Residency {
    automatic, // dense where it fits, unless it takes over half the budget for a quarter of its
               // bricks
    dense,     // one 3D image
    atlas,     // the bricks that the scene needs (brick_atlas.h), as many at a time as fit
};

// The bricks in which rays of a scene may take samples that matter, x fastest; 1 where needed.
using BrickMask = std::vector<uint8_t>;

// Whether a macro-cell that shares a sample with a brick, or one up to `reach` cells from such a
// one, is occupied. `distances` are those between the cells (occupancy.h), x fastest, `side`
// samples a side.
bool is_near_occupied(glm::uvec3 brick, std::span<const uint8_t> distances, glm::uvec3 cell_count,
                      uint32_t side, uint32_t reach);

// Whether interpolation may find more than one value in a brick: it holds several, or its upper
// neighbours hold others.
bool varies(const Volume& volume, glm::uvec3 brick);

// A box of bricks that is marched with its own bricks resident, before the next.
struct Part {
    glm::uvec3 low, high;           // in bricks: [low, high)
    uint32_t eyes;                  // bit e: of eye e
    std::vector<glm::uvec3> bricks; // to be resident: needed, in the box or in reach of it
};

// The eye of a view, which decides which part of a volume lies in front of another.
struct Viewpoint {
    glm::dvec3 eye;       // index
    glm::dvec3 direction; // index, for parallel rays
    bool parallel = false;
};
Viewpoint viewpoint_of(const View& view, const Grid& grid);

// Boxes that cover the volume, each needing at most `capacity` bricks, in front-to-back order for
// every ray of their eyes: one box for all eyes where that suffices. Boxes in which nothing is
// needed are left out, but for one. Fails with both numbers when a single brick and its neighbours
// do not fit.
Result<std::vector<Part>> plan_parts(glm::uvec3 brick_count, const BrickMask& needed,
                                     size_t capacity, double reach_samples,
                                     std::span<const Viewpoint> views);

} // namespace palpate
