#pragma once

#include <functional>
#include <span>

#include "engine/volume/volume.h"

namespace palpate {

// Makes the first snapshot of a volume, brick by brick; different bricks may be set from
// different threads. Bricks that are never set hold zero.
class VolumeBuilder {
 public:
    // grid.size >= 1 on every axis.
    VolumeBuilder(const Grid& grid, ScalarType type);

    glm::uvec3 brick_count() const { return root_->brick_count; }
    void set_brick(glm::uvec3 position, BrickPtr brick);

    // The builder is spent afterwards.
    Volume finish();

 private:
    std::shared_ptr<Volume::Root> root_;
    std::vector<std::shared_ptr<Page>> pages_;
};

// From samples in x-fastest order; exactly sample_count(grid) of them. Threaded.
template <class T>
Volume make_volume(const Grid& grid, std::span<const T> samples);

// From a function of the sample index, rounded to the nearest value of `type` and clamped to its
// range. Called from several threads.
Volume make_volume(const Grid& grid, ScalarType type,
                   const std::function<double(glm::uvec3 index)>& value);

// One brick of that volume, for callers that write each brick before building the next. position <
// size / 32 rounded up, on every axis.
BrickPtr make_brick(const Grid& grid, ScalarType type,
                    const std::function<double(glm::uvec3 index)>& value, glm::uvec3 position);

// The same bricks under another grid of the same size.
Volume with_grid(const Volume& volume, const Grid& grid);

// The next version number: positive, different for every call in this process.
uint64_t next_version();

// Fills range and no_data_count: of a page from its bricks, of a root from its pages. So an edit
// looks at the bricks of the pages it copied, and at no others.
void summarise(Page& page);
void summarise(Volume::Root& root);

} // namespace palpate
