#pragma once

#include <array>
#include <memory>
#include <vector>

#include "engine/volume/brick.h"
#include "engine/volume/grid.h"

namespace palpate {

constexpr uint32_t kPageSide = 4; // bricks
constexpr uint32_t kBricksPerPage = 64;

// 4x4x4 bricks; what an edit copies on its way to one brick. Entries beyond the volume are null.
struct Page {
    std::array<BrickPtr, kBricksPerPage> bricks;
    ValueRange range; // of all its bricks
    uint64_t no_data_count = 0;
};

// An immutable snapshot of a sampled field: a grid and a two-level table of shared bricks.
//
// A Volume is a value: copying it shares everything. Snapshots are made by VolumeBuilder and
// VolumeEdit, each with a version of its own; a later snapshot has a higher version. Reading is
// safe from any number of threads.
class Volume {
 public:
    const Grid& grid() const { return root_->grid; }
    glm::uvec3 size() const { return root_->grid.size; }
    ScalarType type() const { return root_->type; }
    uint64_t version() const { return root_->version; }

    // Bricks on each axis: size / 32 rounded up.
    glm::uvec3 brick_count() const { return root_->brick_count; }

    // position < brick_count() on every axis.
    const Brick& brick(glm::uvec3 position) const { return *brick_ptr(position); }
    const BrickPtr& brick_ptr(glm::uvec3 position) const {
        const glm::uvec3 page = position / kPageSide;
        const glm::uvec3 slot = position % kPageSide;
        return root_
            ->pages[page.x + root_->page_count.x * (page.y + size_t{root_->page_count.y} * page.z)]
            ->bricks[slot.x + kPageSide * (slot.y + kPageSide * slot.z)];
    }
    // How many samples of a brick lie inside the volume, on each axis: 1 .. 32.
    glm::uvec3 valid_in_brick(glm::uvec3 position) const {
        return glm::min(glm::uvec3(kBrickSide), size() - position * kBrickSide);
    }

    // The sample at `index`, each component < size(); NaN where there is no data.
    float value(glm::uvec3 index) const {
        return brick(index / kBrickSide).value(offset_in_brick(index % kBrickSide));
    }

    ValueRange range() const { return root_->range; }
    uint64_t no_data_count() const { return root_->no_data_count; }
    size_t bytes() const; // of bricks (each distinct one once) and tables

    // Two handles of one snapshot.
    bool is_same_as(const Volume& other) const { return root_ == other.root_; }

    struct Root { // immutable; written only by the builder and the edit
        Grid grid;
        ScalarType type{};
        uint64_t version = 0;
        glm::uvec3 brick_count{};
        glm::uvec3 page_count{};
        std::vector<std::shared_ptr<const Page>> pages;
        ValueRange range;
        uint64_t no_data_count = 0;
    };
    explicit Volume(std::shared_ptr<const Root> root) : root_(std::move(root)) {}
    const Root& root() const { return *root_; }

 private:
    std::shared_ptr<const Root> root_;
};

// Calls visit(brick_position) for every brick, x fastest.
template <class Visit>
void for_each_brick(const Volume& volume, Visit&& visit) {
    const glm::uvec3 count = volume.brick_count();
    for (uint32_t z = 0; z < count.z; ++z)
        for (uint32_t y = 0; y < count.y; ++y)
            for (uint32_t x = 0; x < count.x; ++x)
                visit(glm::uvec3(x, y, z));
}

// Copies samples [0, count) of the row (*, y, z) that start at x0, converted to float.
// For writers and slices, which read rows and keep no copy of the volume.
void read_row(const Volume& volume, glm::uvec3 start, uint32_t count, float* out);

} // namespace palpate
