#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "engine/volume/brick.h"

// Sets of samples of a brick, a bit each.
namespace palpate {

constexpr uint32_t kBrickRows = kBrickSide * kBrickSide;
using BrickBits = std::array<uint32_t, kBrickRows>; // bit x of row y + 32 z

// Calls visit(row, x) for every set bit, in order.
template <class Visit>
void for_each_bit(const BrickBits& bits, const Visit& visit) {
    for (uint32_t row = 0; row < kBrickRows; ++row)
        for (uint32_t left = bits[row]; left != 0; left &= left - 1)
            visit(row, std::countr_zero(left));
}

inline bool any(const BrickBits& bits) {
    uint32_t all = 0;
    for (const uint32_t row : bits)
        all |= row;
    return all != 0;
}

// The bits of a brick and of the samples beside its faces.
class BitTile {
 public:
    // row_of(i, row) gives rows of the brick (i = 0) and of those beside it: low and high x, y, z.
    template <class Row>
    explicit BitTile(const Row& row_of);

    // The bits of a row.
    uint32_t row(uint32_t y, uint32_t z) const { return rows_[y + 1 + kSide * (z + 1)]; }
    // The samples of a row whose neighbour has its bit set: that on low and high x, y, z.
    std::array<uint32_t, 6> beside(uint32_t y, uint32_t z) const {
        const uint32_t* at = &rows_[y + 1 + kSide * (z + 1)];
        const uint32_t ends = ends_[y + kBrickSide * z];
        return {*at << 1 | (ends & 1u),
                *at >> 1 | (ends & 1u << 31),
                at[-1],
                at[1],
                at[-int(kSide)],
                at[kSide]};
    }

 private:
    static constexpr uint32_t kSide = kBrickSide + 2;
    std::array<uint32_t, size_t{kSide} * kSide> rows_{};
    BrickBits ends_; // bits 0 and 31: what lies beside them on x
};

template <class Row>
BitTile::BitTile(const Row& row_of) {
    constexpr uint32_t kLast = kBrickSide - 1;
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y) {
            const uint32_t row = y + kBrickSide * z;
            rows_[y + 1 + kSide * (z + 1)] = row_of(0, row);
            ends_[row] = row_of(1, row) >> kLast | row_of(2, row) << kLast;
        }
    for (uint32_t i = 0; i < kBrickSide; ++i) {
        rows_[kSide * (i + 1)] = row_of(3, kLast + kBrickSide * i);
        rows_[kSide - 1 + kSide * (i + 1)] = row_of(4, kBrickSide * i);
        rows_[i + 1] = row_of(5, i + kBrickSide * kLast);
        rows_[i + 1 + kSide * (kSide - 1)] = row_of(6, i);
    }
}

} // namespace palpate
