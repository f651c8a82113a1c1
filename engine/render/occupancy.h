#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/scene/transfer_function.h"
#include "engine/volume/cell_range.h"

namespace palpate {

// Tells in constant time whether any value between two values can be seen: whether the table of a
// transfer function has an entry with opacity among those that such values are looked up at, or an
// iso-value lies between them.
class VisibleValues {
 public:
    // Entries of a table (transfer_function.h), by their running count.
    explicit VisibleValues(const TransferTable& table);
    explicit VisibleValues(std::span<const double> iso_values);

    bool any(double low, double high) const;

 private:
    double table_low_ = 0, entries_per_value_ = 0;
    std::vector<uint32_t> opaque_before_; // entries below i with opacity; one more than entries
    std::vector<uint32_t> narrow_before_; // the same of what lies between an entry and the next
    std::vector<double> isos_;
};

// How far a sampled value may lie outside the range of the macro-cell that its position is looked
// up in. A device rounds the position to a few units in the last place of the largest texture
// coordinate, `rounding` samples at most, on each of three axes; a sample beyond a face takes that
// share of a neighbouring value, which lies within the volume's range.
double range_margin(const Volume& volume);

// Whether something in a cell can be seen. With `gaps_matter` a cell with data and gaps counts as
// seen: what crosses a surface there depends on where the gap is. It needs ranges.gaps.
inline bool is_occupied(const CellRanges& ranges, size_t cell, const VisibleValues& visible,
                        double margin, bool gaps_matter) {
    return ranges.low[cell] <= ranges.high[cell] &&
           ((gaps_matter && ranges.gaps[cell]) ||
            visible.any(ranges.low[cell] - margin, ranges.high[cell] + margin));
}

// For each cell 1 where is_occupied(), 0 elsewhere; ranges.gaps may be missing.
std::vector<uint8_t> occupied_cells(const CellRanges& ranges, const VisibleValues& visible,
                                    double margin, bool gaps_matter);

// Turns occupancy (1 or 0 a cell, x fastest) into distances: 0 for an occupied cell, else the
// largest d <= kMaxCellDistance such that every cell less than d cells away on each axis is empty.
// Beyond the grid everything is empty.
constexpr uint8_t kMaxCellDistance = 15;
void chebyshev_distances(std::vector<uint8_t>& cells, glm::uvec3 count);

} // namespace palpate
