#pragma once

#include <array>
#include <cstdint>
#include <stop_token>

#include "engine/edit/sweep.h"
#include "engine/volume/brick.h"

namespace palpate {

// A set of samples of one brick: one word a row of x, rows y fastest, bit x of a word.
struct SampleMask {
    std::array<uint32_t, kBrickSide * kBrickSide> rows{};

    uint32_t& row(uint32_t y, uint32_t z) { return rows[y + kBrickSide * z]; }
    uint32_t row(uint32_t y, uint32_t z) const { return rows[y + kBrickSide * z]; }
    bool has(glm::uvec3 local) const { return row(local.y, local.z) >> local.x & 1; }
    bool empty() const;
    uint32_t count() const;
    // Takes out of this what `seen` has, and adds the rest to `seen`.
    void keep_new(SampleMask& seen);
};

// The places in a brick that a sweep may touch, both ends included; none where low > high.
struct SampleBox {
    glm::ivec3 low{0}, high{-1};
};
SampleBox samples_of(const Sweep& sweep, glm::uvec3 brick, glm::uvec3 valid);

// Adds the samples of a brick that a sweep holds. `valid`: how many samples on each axis lie in the
// volume. What a sample is is decided by sweep.at() at its place; rows are filled in leaps as long
// as its verdict is good for, less a millionth of a millimetre for rounding. Ends early, at a row,
// where `stop` is requested.
void add_samples(SampleMask& mask, const Sweep& sweep, const Grid& grid, glm::uvec3 brick,
                 glm::uvec3 valid, const std::stop_token& stop = {});

// The bricks that a sweep may touch: low .. high, both included; none if low > high on some axis.
struct BrickRange {
    glm::ivec3 low{0}, high{-1};
    bool empty() const { return glm::any(glm::greaterThan(low, high)); }
};
BrickRange bricks_of(const Sweep& sweep, const Grid& grid);

// Calls visit(x) for every bit of a row, rising.
template <class Visit>
void for_each_bit(uint32_t row, Visit&& visit) {
    for (; row != 0; row &= row - 1)
        visit(static_cast<uint32_t>(__builtin_ctz(row)));
}

} // namespace palpate
