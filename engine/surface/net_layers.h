#pragma once

#include <array>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "engine/surface/net_cell.h"
#include "engine/volume/volume.h"

// The net of walls between all labels of a volume, without positions: which cells have vertices,
// and which of them each piece of wall has as corners.
namespace palpate {

// Cell c has samples c - 1 and c on each axis as corners; 0 <= c <= size. Its centre lies at c -
// 0.5.
struct NetVertex {
    glm::u16vec3 cell;
};

// The wall between two samples side by side: counter-clockwise seen from the outer label. Where
// that is not the sample beyond, the order is turned about and still begins with the same vertex.
struct NetWall {
    std::array<uint32_t, 4> corners;
    uint16_t label, outer; // label > outer
};

// A vertex of a cell that has several, and the crossed edges that lead to it.
struct NetApart {
    uint32_t vertex;
    uint16_t edges;
};

// A wall of which sides pass through split faces (net_cell.h). Side i is between corners i and
// i + 1.
struct NetSplit {
    uint32_t wall;
    std::array<int8_t, 4> corner{-1, -1, -1, -1}; // of the face, as of a cell; the bit of its axis
                                                  // is 0; -1 where the side is not split
    std::array<int8_t, 4> axis{};                 // the face's normal
    std::array<uint64_t, 4> face{};               // a number for each face of the volume
};

// Vertices joined through a face. `is_line`: where three walls or more meet.
struct NetLink {
    uint32_t a, b;
    bool is_line;
};

struct Net {
    std::vector<NetVertex> vertices;
    std::vector<NetWall> walls;
    std::vector<NetApart> apart;
    std::vector<NetSplit> splits;
    std::vector<NetLink> links; // where asked for
};

// Cells first .. last on each axis; none where last is before first.
struct NetCells {
    glm::ivec3 first, last;

    bool holds(glm::ivec3 cell) const {
        return glm::all(glm::greaterThanEqual(cell, first)) &&
               glm::all(glm::lessThanEqual(cell, last));
    }
};

// With the links between `linked` cells. Threaded: layers of cells in chunks, put together in their
// order.
Net make_net(const Volume& labels, const NetCells& linked, const std::stop_token& stop);

} // namespace palpate
