#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/segment/grow_heights.h"
#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

struct GrowTile;

// Every sample to the seed that reaches it first, while water rises over the edges of a volume.
//
// A path from a seed has a cost in mm: 0 at the seed, and at each next sample, which shares a face
// with the one before,
//     cost(next) = max(cost(before), height(next)) + distance between the two.
// height() is that of grow_heights(): a path waits before an edge until its cost is the edge's
// height, and walks on. A sample has the label of the path of least cost; of equal ones, the least
// label. Since such costs never fall along a path, and every step adds to them, costs and labels
// are one answer, whatever the order of the work (an image foresting transform: Falcao, Stolfi &
// de Alencar Lotufo 2004).
//
// So update() works on what changed seeds reach alone (Falcao & Bergo 2004), and its result is that
// of a fresh forest to the bit; so is that of any number of threads. Distances are whole numbers of
// 1/16 of the smallest spacing, at least 1.
//
// Memory: 7 bytes a sample (height 2, cost 4, label 1) beside volume and result, and queues of the
// samples at the fronts.
class SeedForest {
 public:
    // A forest without seeds yet. `heights` as of grow_heights(), a sample of the grid each;
    // `highest_mm` > 0 is the height in mm of the highest rank.
    SeedForest(const Grid& grid, std::vector<uint16_t> heights, double highest_mm);
    SeedForest(SeedForest&&) noexcept;
    SeedForest& operator=(SeedForest&&) noexcept;
    ~SeedForest();

    // Makes it the forest of these seeds, a label map on the grid. Seeds on walls are none. Work
    // that was stopped leaves a forest without seeds, as a new one. Refused: another grid, more
    // than 255 labels since the forest was new.
    Result<void> update(const Volume& seeds, const Task& task);

    // Labels of all samples, 0 where no seed reaches and where `background` has won; u8 or u16.
    Result<Volume> labels(ScalarType type, uint16_t background, const Task& task) const;

    // Costs in mm, f32; no data where no seed reaches.
    Result<Volume> costs(const Task& task) const;

    uint64_t served() const {
        return served_;
    }                     // samples passed on by the last update, with repeats
    size_t bytes() const; // held between updates

 private:
    static constexpr uint32_t kNever = ~uint32_t{0};

    size_t at(glm::uvec3 index) const {
        return index.x + size_t{size_.x} * (index.y + size_t{size_.y} * index.z);
    }
    glm::uvec3 index_of(size_t sample) const;
    glm::uvec3 position_of(size_t tile) const;
    GrowTile& tile_at(glm::uvec3 index);

    void clear();
    Result<uint8_t> rank_of(uint16_t label);
    Result<void> take_seeds(const Volume& seeds, std::vector<size_t>& removed);
    void cut(const std::vector<size_t>& removed);
    bool spread(const Task& task);
    void run(size_t number, uint32_t end);

    // The cost of a step from a cost to a sample of a height.
    uint32_t step(uint32_t from, uint16_t height, int axis) const {
        const uint64_t cost =
            std::max(uint64_t{from}, uint64_t{height} * highest_ >> 16) + distance_[size_t(axis)];
        return from != kNever && height != kGrowWall && cost < kNever ? uint32_t(cost) : kNever;
    }
    // Calls visit(axis, sample) for the samples that share a face with one.
    template <class Visit>
    void for_each_neighbor(glm::uvec3 index, const Visit& visit) const {
        const size_t sample = at(index);
        const size_t strides[] = {1, size_.x, size_t{size_.x} * size_.y};
        for (int axis = 0; axis < 3; ++axis) {
            if (index[axis] > 0)
                visit(axis, sample - strides[axis]);
            if (index[axis] + 1 < size_[axis])
                visit(axis, sample + strides[axis]);
        }
    }
    // The least cost of a step from a neighbour, and the least label of those that give it.
    struct Reached {
        uint32_t cost;
        uint8_t label;
    };
    Reached from_neighbors(size_t sample, glm::uvec3 index) const;

    friend class GrowTileRun;

    Grid grid_;
    glm::uvec3 size_, tiles_a_side_;
    double unit_mm_ = 1.0;
    uint64_t highest_ = 1;               // height in units of a rank of 65536
    std::array<uint32_t, 3> distance_{}; // of neighbours along each axis, in units
    std::vector<uint16_t> heights_;
    std::vector<uint32_t> costs_;   // kNever: not reached
    std::vector<uint8_t> labels_;   // places in numbers_
    std::vector<uint16_t> numbers_; // the labels of seeds so far; the first is 0, none
    std::vector<GrowTile> tiles_;
    std::optional<Volume> seeds_;
    uint64_t served_ = 0;
};

} // namespace palpate
