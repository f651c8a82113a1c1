#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/surface/cell_tables.h"

// The topology of the trilinear interpolant within one cell, from its eight corners.
//
// Mode `correct` decides ambiguous faces by the bilinear interpolant's saddle (Nielson & Hamann,
// "The asymptotic decider", Visualization 1991), and finds by a sweep which corners are connected
// through the interior. Ties count as inside, as if the iso-value were lower by less than anything:
// a corner or a saddle equal to the iso-value is inside.
namespace palpate {

// Value minus iso-value at each corner; inside where >= 0. Corners without data are lower than
// every value (kNoData).
using CornerValues = std::array<double, 8>;
constexpr double kNoData = -1e100;

// NaN is no data.
CornerValues corner_values(const std::array<float, 8>& values, float iso);

uint8_t inside_corners(const CornerValues& values);

// Bit f: the inside corners are joined across the ambiguous face f. A function of its corners
// alone, and of them in an order that both its cells see.
uint8_t joined_faces(uint8_t inside, const CornerValues& values);

// The connections of corners within the cell, given those on its faces.
//
// Sweeps a plane along z. In each slice the interpolant is bilinear, so that corners of one sign
// are connected along edges, or across by the sign of the saddle; between the zeros of the four
// columns and of the saddle, at most six, that does not change. A slice has no part that holds no
// corner, so the corners of neighbouring slices tell how parts go on.
CornerClasses interior_classes(uint8_t inside, const CornerClasses& boundary,
                               const CornerValues& values);

// The surfaces of mode `correct`: for each case and each way of deciding its faces, with discs
// alone and with a tube between any two loops that may have one.
class CorrectTable {
 public:
    static constexpr size_t kMostTriangles = 24, kMostInner = 6; // of one cell

    CorrectTable();

    // False where the case alone says what the surface is: then it is that of the classic table.
    bool needs_values(uint8_t inside) const { return needs_values_[inside]; }

    // needs_values(inside) must hold.
    const CellSurface& surface(uint8_t inside, const CornerValues& values) const;

    size_t surfaces() const; // how many there are

 private:
    struct Tube {
        uint8_t from, to; // the boundary classes that it connects
        CellSurface surface;
    };
    struct Entry {
        CornerClasses classes;
        CellSurface discs;
        std::vector<Tube> tubes;
    };
    std::array<bool, 256> needs_values_{};
    std::array<uint32_t, 256> first_{}; // of its entries, one for each subset of ambiguous faces
    std::vector<Entry> entries_;
};
const CorrectTable& correct_table(); // made at the first call

} // namespace palpate
