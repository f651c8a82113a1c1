#include "engine/render/cell_distances.h"

#include <algorithm>
#include <utility>

#include "engine/base/assert.h"
#include "engine/render/occupancy.h"

namespace palpate {

namespace {

// A cell's distance depends only on cells that are less than this far away.
constexpr uint32_t kReach = kMaxCellDistance - 1;

template <class Visit>
void for_each_row(const CellBox& box, const Visit& visit) {
    for (uint32_t z = box.low.z; z < box.high.z; ++z)
        for (uint32_t y = box.low.y; y < box.high.y; ++y)
            visit(y, z);
}

CellBox around(const CellBox& a, const CellBox& b) {
    if (a.empty() || b.empty())
        return a.empty() ? b : a;
    return {glm::min(a.low, b.low), glm::max(a.high, b.high)};
}

} // namespace

CellBox widened(const CellBox& box, uint32_t reach, glm::uvec3 count) {
    return {box.low - glm::min(box.low, glm::uvec3(reach)), glm::min(box.high + reach, count)};
}

std::vector<CellBox> joined(std::span<const CellBox> boxes, uint32_t reach, glm::uvec3 count) {
    const auto cost = [&](const CellBox& box) { return widened(box, reach, count).cells(); };
    std::vector<CellBox> found;
    for (CellBox box : boxes) {
        for (size_t i = found.size(); i-- > 0;) { // one that grew may take in others
            const CellBox both = around(found[i], box);
            if (cost(both) > cost(found[i]) + cost(box))
                continue;
            box = both;
            found.erase(found.begin() + static_cast<ptrdiff_t>(i));
            i = found.size();
        }
        found.push_back(box);
    }
    return found;
}

CellDistances::CellDistances(std::vector<uint8_t> occupied, glm::uvec3 count)
    : count_(count),
      tiles_((count + (kTileSide - 1)) / kTileSide),
      values_(std::move(occupied)),
      waiting_(size_t{tiles_.x} * tiles_.y * tiles_.z, 0),
      raised_(waiting_) {
    chebyshev_distances(values_, count_);
}

CellBox CellDistances::box_of(uint32_t tile) const {
    const glm::uvec3 low = kTileSide * glm::uvec3(tile % tiles_.x, tile / tiles_.x % tiles_.y,
                                                  tile / (tiles_.x * tiles_.y));
    return {low, glm::min(low + kTileSide, count_)};
}

template <class Visit>
void CellDistances::for_each_tile(const CellBox& cells, const Visit& visit) const {
    const glm::uvec3 first = cells.low / kTileSide, last = (cells.high - 1u) / kTileSide;
    for (uint32_t z = first.z; z <= last.z; ++z)
        for (uint32_t y = first.y; y <= last.y; ++y)
            for (uint32_t x = first.x; x <= last.x; ++x)
                visit(x + tiles_.x * (y + tiles_.y * z));
}

// The tiles that these cells lie in are to be looked at.
void CellDistances::push_tiles(const CellBox& cells) {
    for_each_tile(cells, [&](uint32_t tile) {
        if (!std::exchange(waiting_[tile], uint8_t{1}))
            queue_.push_back(tile);
    });
}

void CellDistances::mark_raised(uint32_t tile) {
    if (!std::exchange(raised_[tile], uint8_t{1}))
        to_take_.push_back(tile);
}

CellBox CellDistances::update(const CellBox& box, std::span<const uint8_t> occupied) {
    PALPATE_ASSERT_CMP(occupied.size(), ==, box.cells());
    CellBox filled, emptied;
    size_t i = 0;
    for_each_row(box, [&](uint32_t y, uint32_t z) {
        for (uint32_t x = box.low.x; x < box.high.x; ++x) {
            const glm::uvec3 cell(x, y, z);
            uint8_t& value = values_[index_of(cell)];
            const bool was = value == 0, is = occupied[i++] != 0;
            if (was == is)
                continue;
            CellBox& grown = is ? filled : emptied;
            grown = around(grown, {cell, cell + 1u});
            value = is ? 0 : 1;
        }
    });
    if (!emptied.empty()) {
        push_tiles(widened(emptied, 1, count_)); // whose distances may follow
        for_each_tile(emptied, [&](uint32_t tile) { mark_raised(tile); });
    }
    if (filled.empty())
        return {};
    const CellBox reached = widened(filled, kReach, count_);
    const glm::uvec3 size = reached.high - reached.low;
    std::vector<uint8_t> to_filled(reached.cells());
    const auto row_of = [&](uint32_t y, uint32_t z) {
        return &to_filled[size.x * (y - reached.low.y + size_t{size.y} * (z - reached.low.z))];
    };
    for_each_row(filled, [&](uint32_t y, uint32_t z) {
        for (uint32_t x = filled.low.x; x < filled.high.x; ++x)
            row_of(y, z)[x - reached.low.x] = values_[index_of({x, y, z})] == 0;
    });
    chebyshev_distances(to_filled, size);
    CellBox lowered = filled;
    for_each_row(reached, [&](uint32_t y, uint32_t z) {
        const uint8_t* const to = row_of(y, z);
        uint8_t* const row = &values_[index_of({reached.low.x, y, z})];
        uint32_t first = size.x, last = 0;
        for (uint32_t x = 0; x < size.x; ++x)
            if (to[x] < row[x]) {
                row[x] = to[x];
                first = std::min(first, x);
                last = x;
            }
        if (first < size.x)
            lowered = around(
                lowered, {{reached.low.x + first, y, z}, {reached.low.x + last + 1, y + 1, z + 1}});
    });
    return lowered;
}

// An empty cell's distance is one more than the least of its neighbours', so that one more than the
// least about it, itself included, is never too much. Raised that far again and again, distances
// end where they would be from scratch: no others are one more than the least about them, all over.
// Returns a box about the cells that were raised.
CellBox CellDistances::raise_once(const CellBox& tile) {
    constexpr uint32_t kWide = kTileSide + 2;
    const glm::uvec3 size = tile.high - tile.low;
    uint8_t along_x[kWide][kWide][kTileSide]; // the least of three; beyond the grid all is empty
    for (uint32_t z = 0; z < size.z + 2; ++z)
        for (uint32_t y = 0; y < size.y + 2; ++y) {
            uint8_t row[kWide];
            std::fill_n(row, kWide, kMaxCellDistance);
            const glm::uvec3 at(tile.low.x, tile.low.y + y, tile.low.z + z); // one too far
            if (at.y >= 1 && at.y <= count_.y && at.z >= 1 && at.z <= count_.z) {
                const uint32_t before = at.x > 0 ? 1 : 0;
                const uint32_t end = std::min(tile.high.x + 1, count_.x);
                std::copy_n(&values_[index_of({at.x - before, at.y - 1, at.z - 1})],
                            end - at.x + before, row + 1 - before);
            }
            for (uint32_t x = 0; x < kTileSide; ++x)
                along_x[z][y][x] = std::min({row[x], row[x + 1], row[x + 2]});
        }
    CellBox changed;
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y) {
            uint8_t least[kTileSide];
            std::fill_n(least, kTileSide, kMaxCellDistance);
            for (uint32_t k = 0; k < 3; ++k)
                for (uint32_t j = 0; j < 3; ++j)
                    for (uint32_t x = 0; x < kTileSide; ++x)
                        least[x] = std::min(least[x], along_x[z + k][y + j][x]);
            const glm::uvec3 first = tile.low + glm::uvec3(0, y, z);
            uint8_t* const row = &values_[index_of(first)];
            uint32_t begin = size.x, end = 0;
            for (uint32_t x = 0; x < size.x; ++x) {
                const auto more =
                    std::min<uint8_t>(static_cast<uint8_t>(least[x] + 1), kMaxCellDistance);
                if (row[x] == 0 || row[x] >= more)
                    continue;
                row[x] = more;
                begin = std::min(begin, x);
                end = x + 1;
            }
            if (begin < end)
                changed = around(changed,
                                 {first + glm::uvec3(begin, 0, 0), first + glm::uvec3(end, 1, 1)});
        }
    return changed;
}

size_t CellDistances::raise(size_t tiles) {
    size_t looked_at = 0;
    for (; looked_at < tiles && !queue_.empty(); ++looked_at) {
        const uint32_t tile = queue_.front();
        queue_.pop_front();
        waiting_[tile] = 0;
        const CellBox changed = raise_once(box_of(tile));
        if (changed.empty())
            continue;
        push_tiles(widened(changed, 1, count_));
        mark_raised(tile);
    }
    return looked_at;
}

std::vector<CellBox> CellDistances::take_raised(size_t tiles) {
    std::vector<CellBox> taken;
    for (size_t n = std::min(to_take_.size(), 8 * tiles); n > 0 && taken.size() < tiles; --n) {
        const uint32_t tile = to_take_.front();
        to_take_.pop_front();
        if (waiting_[tile]) {
            to_take_.push_back(tile);
            continue;
        }
        raised_[tile] = 0;
        taken.push_back(box_of(tile));
    }
    return taken;
}

} // namespace palpate
