#pragma once

#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace palpate {

// A box of macro-cells: [low, high).
struct CellBox {
    glm::uvec3 low{0}, high{0};

    bool empty() const { return glm::any(glm::greaterThanEqual(low, high)); }
    uint64_t cells() const {
        return empty() ? 0
                       : uint64_t{high.x - low.x} * (high.y - low.y) * (uint64_t{high.z} - low.z);
    }
};

// `box` and the cells up to `reach` beside it that a grid of `count` cells has.
CellBox widened(const CellBox& box, uint32_t reach, glm::uvec3 count);

// The same cells in fewer boxes: two become one where that one, widened by `reach`, has no more
// cells than both, widened.
std::vector<CellBox> joined(std::span<const CellBox> boxes, uint32_t reach, glm::uvec3 count);

// Distances between macro-cells (occupancy.h) that follow their occupancy at the cost of what
// changes.
//
// A cell that comes to hold something lowers the distances around it at once. One that became empty
// leaves those around it lower than they could be, which is safe: raise() raises them later, as far
// as it is allowed to go at a time.
class CellDistances {
 public:
    CellDistances() = default;
    // `occupied`: 1 or 0 a cell, x fastest.
    CellDistances(std::vector<uint8_t> occupied, glm::uvec3 count);

    // x fastest; 0 for occupied cells and no others.
    const std::vector<uint8_t>& values() const { return values_; }
    uint8_t at(glm::uvec3 cell) const { return values_[index_of(cell)]; }

    // Cells of `box` hold something or not: `occupied`, 1 or 0 a cell of it, x fastest. Returns a
    // box of all cells whose distances became lower.
    CellBox update(const CellBox& box, std::span<const uint8_t> occupied);

    // Raises distances, looking at up to `tiles` tiles of kTileSide cells a side; how many it
    // looked at. When that is none, every distance is what it would be from scratch.
    size_t raise(size_t tiles);
    // Up to `tiles` boxes that raise() is done with, of cells that became empty or whose distances
    // rose since they were taken.
    std::vector<CellBox> take_raised(size_t tiles);

    static constexpr uint32_t kTileSide = 16;

 private:
    size_t index_of(glm::uvec3 cell) const {
        return cell.x + count_.x * (cell.y + size_t{count_.y} * cell.z);
    }
    CellBox box_of(uint32_t tile) const;
    template <class Visit>
    void for_each_tile(const CellBox& cells, const Visit& visit) const; // not empty
    void push_tiles(const CellBox& cells);
    void mark_raised(uint32_t tile);
    CellBox raise_once(const CellBox& tile);

    glm::uvec3 count_{0}, tiles_{0};
    std::vector<uint8_t> values_;
    std::vector<uint8_t> waiting_, raised_; // flags of tiles: in queue_; in to_take_
    std::deque<uint32_t> queue_, to_take_;
};

} // namespace palpate
