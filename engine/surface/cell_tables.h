#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

// The triangles of marching cubes, derived from the geometry of the cube.
//
// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). A case is one byte: bit c is set
// where corner c is inside. Edge e runs along axis e / 4; (e & 1, e >> 1 & 1) is where it lies on
// the two other axes, in order. Face f is the lower (f & 1 = 0) or upper side of axis f / 2.
//
// On each face the surface leaves lines that join its crossed edges. Where all four edges are
// crossed, two pairings are possible: inside corners joined, or apart. That is decided from the
// four corners of the face alone, so that the two cells which share it decide alike. The lines of
// the six faces make closed loops, which are filled with triangles. No triangle has a side across a
// face other than such a line: so every side within a face is shared with exactly one triangle of
// the neighbour, every other side with exactly one of the same cell, and the surface is closed and
// manifold whatever the cases are.
namespace palpate {

struct CellEdge {
    uint8_t corner; // its lower end; the upper end is corner + (1 << axis)
    uint8_t axis;
};
constexpr CellEdge cell_edge(int e) {
    const int axis = e / 4, low = e & 1, high = e >> 1 & 1;
    const int corner = axis == 0 ? 2 * low + 4 * high : axis == 1 ? low + 4 * high : low + 2 * high;
    return {static_cast<uint8_t>(corner), static_cast<uint8_t>(axis)};
}
// Bit f: face f holds the edge. Each edge lies on two faces.
uint8_t faces_of_edge(int edge);

// The corners of face f, counter-clockwise seen from outside the cell.
std::array<uint8_t, 4> face_corners(int face);

// Bit f: on face f the inside corners lie diagonally, and so do the outside ones.
uint8_t ambiguous_faces(uint8_t inside);

// A closed loop of crossed edges on the cell's boundary, counter-clockwise seen from outside.
using CellLoop = std::vector<uint8_t>;

// `joined` bit f: inside corners are joined across the ambiguous face f. Bits of others are
// ignored.
std::vector<CellLoop> cell_loops(uint8_t inside, uint8_t joined);

// A number for each corner: corners of one sign with one number are connected.
using CornerClasses = std::array<uint8_t, 8>;

// Connected along edges and across faces.
CornerClasses boundary_classes(uint8_t inside, uint8_t joined);

// A vertex within a cell: a mean of the crossings of edges, with weights that sum to 1.
struct InnerVertex {
    std::array<float, 12> weight{};
};

// Corners of triangles below 12 are crossings of edges; 12 + i is inner[i].
struct CellSurface {
    std::vector<std::array<uint8_t, 3>> triangles; // counter-clockwise seen from outside
    std::vector<InnerVertex> inner;
};

// Each loop filled by a disc: the triangulation with the shortest diagonals between the midpoints
// of edges, none across a face; from a vertex in its middle where there is none such.
CellSurface fill_with_discs(const std::vector<CellLoop>& loops);

// As above, but loops a and b become the two ends of a tube, by way of a ring of inner vertices.
CellSurface fill_with_tube(const std::vector<CellLoop>& loops, size_t a, size_t b);

// Mode `classic`: inside corners lie apart on every ambiguous face, every loop is a disc, and all
// vertices lie on edges.
struct ClassicTable {
    static constexpr size_t kMaxTriangles = 5;
    std::array<uint8_t, 256> triangle_count{};
    std::array<std::array<uint8_t, 3 * kMaxTriangles>, 256> edges{}; // of its triangles, in order
};
const ClassicTable& classic_table(); // made at the first call

} // namespace palpate
