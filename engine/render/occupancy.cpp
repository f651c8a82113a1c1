#include "engine/render/occupancy.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// Rows of at most this many cells are combined at a time: they stay in the cache, and the loops
// over them become vector instructions.
constexpr size_t kLane = 64;

// out[i] = min(out[i], max(d, in[i])) over n cells.
void lower_to(uint8_t* out, const uint8_t* in, uint8_t d, size_t n) {
    for (size_t i = 0; i < n; ++i) {
        const uint8_t reach = std::max(in[i], d);
        out[i] = std::min(out[i], reach);
    }
}

// The distance of lines of cells that lie `stride` apart, `lines` of them, each `n` cells wide.
// `copy` holds lines * n bytes.
void distances_across(uint8_t* cells, size_t stride, size_t lines, size_t n, uint8_t* copy) {
    for (size_t line = 0; line < lines; ++line)
        std::copy_n(cells + line * stride, n, copy + line * n);
    for (size_t line = 0; line < lines; ++line) {
        uint8_t* out = cells + line * stride;
        for (size_t d = 1; d < kMaxCellDistance; ++d) {
            if (line >= d)
                lower_to(out, copy + (line - d) * n, static_cast<uint8_t>(d), n);
            if (line + d < lines)
                lower_to(out, copy + (line + d) * n, static_cast<uint8_t>(d), n);
        }
    }
}

} // namespace

VisibleValues::VisibleValues(const TransferTable& table)
    : table_low_(table.low),
      entries_per_value_(static_cast<double>(table.entries.size() - 1) / (table.high - table.low)) {
    opaque_before_.reserve(table.entries.size() + 1);
    opaque_before_.push_back(0);
    narrow_before_.assign(1, 0);
    for (size_t i = 0; i < table.entries.size(); ++i)
        narrow_before_.push_back(narrow_before_.back() + shows_after(table, i));
    for (size_t i = 0; i < table.entries.size(); ++i)
        opaque_before_.push_back(opaque_before_.back() + (table.entries[i].w > 0.0f));
}

VisibleValues::VisibleValues(std::span<const double> iso_values)
    : isos_(iso_values.begin(), iso_values.end()) {}

bool VisibleValues::any(double low, double high) const {
    for (const double iso : isos_)
        if (low < iso && iso <= high)
            return true;
    if (opaque_before_.empty())
        return false;
    // Every entry that the nearest one to a value within, or an interpolation between two, can be.
    const double last = static_cast<double>(opaque_before_.size() - 2);
    const auto first = static_cast<size_t>(
        std::clamp(std::floor((low - table_low_) * entries_per_value_), 0.0, last));
    const auto end = static_cast<size_t>(
        std::clamp(std::ceil((high - table_low_) * entries_per_value_), 0.0, last));
    return opaque_before_[end + 1] > opaque_before_[first] ||
           narrow_before_[end] > narrow_before_[first];
}

double range_margin(const Volume& volume) {
    const ValueRange range = volume.range();
    if (range.empty())
        return 0.0;
    const glm::uvec3 size = volume.size();
    const double rounding = 4.0 * std::max({size.x, size.y, size.z}) / 16777216.0;
    return 3.0 * rounding * (static_cast<double>(range.max) - range.min);
}

std::vector<uint8_t> occupied_cells(const CellRanges& ranges, const VisibleValues& visible,
                                    double margin, bool gaps_matter) {
    gaps_matter = gaps_matter && !ranges.gaps.empty();
    std::vector<uint8_t> cells(ranges.cells());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, cells.size(), 16384), [&](const auto& part) {
        for (size_t i = part.begin(); i < part.end(); ++i)
            cells[i] = is_occupied(ranges, i, visible, margin, gaps_matter);
    });
    return cells;
}

void chebyshev_distances(std::vector<uint8_t>& cells, glm::uvec3 count) {
    PALPATE_ASSERT_CMP(cells.size(), ==, size_t{count.x} * count.y * count.z);
    const size_t row = count.x, plane = row * count.y;
    tbb::parallel_for(uint32_t{0}, count.z, [&](uint32_t z) {
        std::vector<uint8_t> copy(plane);
        for (uint32_t y = 0; y < count.y; ++y) { // along x, by two scans
            uint8_t* cell = cells.data() + z * plane + y * row;
            uint8_t d = kMaxCellDistance;
            for (size_t x = 0; x < row; ++x)
                cell[x] = d = cell[x] ? uint8_t{0} : std::min<uint8_t>(d + 1, kMaxCellDistance);
            d = kMaxCellDistance;
            for (size_t x = row; x-- > 0;)
                cell[x] = d = std::min({cell[x], static_cast<uint8_t>(d + 1), kMaxCellDistance});
        }
        distances_across(cells.data() + z * plane, row, count.y, row, copy.data());
    });
    const size_t parts = (plane + kLane - 1) / kLane;
    tbb::parallel_for(size_t{0}, parts, [&](size_t part) {
        const size_t first = part * kLane, n = std::min(kLane, plane - first);
        std::vector<uint8_t> copy(n * count.z);
        distances_across(cells.data() + first, plane, count.z, n, copy.data());
    });
}

} // namespace palpate
