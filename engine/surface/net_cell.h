#pragma once

#include <array>
#include <cstdint>

#include "engine/surface/cell_tables.h"

// The walls between labels within one cell of 2 x 2 x 2 samples.
//
// Corners, edges and faces are numbered as in cell_tables.h. An edge whose ends differ is crossed
// by a wall. Where walls cross a face they are linked there; walls linked through any faces of the
// cell meet in one vertex of it.
//
// A face whose corners lie crosswise (a b / b a, or a b / c a) is split: its four walls are linked
// two by two, so that one label goes on across and the others are apart. Across goes the label that
// lies on a diagonal, and of two the higher. The face alone decides, so both its cells agree. With
// four labels, or two alike side by side, all walls of the face are linked.
namespace palpate {

struct NetCell {
    uint16_t crossed = 0; // bit e: edge e is
    uint8_t vertices = 0; // 0 .. 4
    uint16_t splits = 0;  // two bits a face: 1 for FaceLink::split_0, 2 for split_1, else 0
    std::array<uint8_t, 12> vertex{}; // of each crossed edge, 0 .. vertices - 1
};

// The four corners of face f and, between corner i and the next, edge i.
struct NetFace {
    std::array<uint8_t, 4> corners, edges;
};
const NetFace& net_face(int face);

enum class FaceLink : uint8_t {
    none,    // no wall crosses the face
    wall,    // two do: one wall goes on
    line,    // three or four do, and meet in a line
    split_0, // corners 0 and 2 are cut off, each by the two walls beside it
    split_1, // corners 1 and 3 are
};
FaceLink face_link(uint16_t a, uint16_t b, uint16_t c, uint16_t d); // labels of its corners in turn

// From the labels of the eight corners.
NetCell net_cell(const std::array<uint16_t, 8>& labels);

// The same for two labels, by table: bit c of `pattern` is set where corner c has the higher one.
const NetCell& net_cell_of_two(uint8_t pattern);

// net_cell(labels), by that table where there are two.
NetCell quick_net_cell(const std::array<uint16_t, 8>& labels);

} // namespace palpate
