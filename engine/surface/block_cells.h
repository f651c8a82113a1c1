#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "engine/surface/marching_cubes.h"
#include "engine/surface/trilinear_cell.h"

// Marching cubes within one block of 8x8x8 samples: what full, incremental and local extraction
// share. Positions in a block count samples from its first one; -1 and 8, 9 are its neighbours'.
namespace palpate::block {

constexpr int kSide = 8; // samples that own edges and cells; edges and cells reach sample 8

// A block with the samples about it that its vertices and their gradients read: -1 .. 9.
struct Samples {
    static constexpr int kStride[3] = {1, 12, 132};
    static constexpr int kCount = 11 * 132 + 8; // rows are written eight at a time
    static constexpr int at(int x, int y, int z) { return x + 1 + 12 * (y + 1) + 132 * (z + 1); }

    alignas(64) std::array<float, kCount> value;
    bool has_gaps = false; // some are NaN: no data, or beyond a border that is to be closed
};

// Bit x of row[z][y]: sample (x, y, z) is inside. 0 .. 9 on each axis.
struct Signs {
    std::array<std::array<uint16_t, 10>, 10> row;
};
Signs signs_of(const Samples& samples, float iso);

// The volume's last sample, counted from the block's first one, on each axis: 0 .. 9, 9 if later.
using Last = glm::ivec3;

// An edge by its lower sample and its axis; the numbers of edges that start at a cell's corners
// differ from each other by the same amounts in every cell.
constexpr int edge_number(int x, int y, int z, int axis) {
    return 4 * Samples::at(x, y, z) + axis;
}
// The lower sample of an edge.
inline glm::ivec3 sample_of(int number) {
    const int at = number / 4;
    return {at % 12 - 1, at / 12 % 11 - 1, at / 132 - 1};
}
constexpr int kEdgeNumbers = 4 * Samples::kCount;
constexpr int kMostEdges = 3 * 9 * 9 * 9;
constexpr int kMostInner = 512 * static_cast<int>(CorrectTable::kMostInner);
constexpr int kMostTriangles = 512 * static_cast<int>(CorrectTable::kMostTriangles);

// The cells that the surface may cross, in order.
struct Cells {
    int count = 0;
    std::array<uint16_t, 512> first_edge; // edge_number() of the cell's lowest corner, axis 0
    std::array<uint8_t, 512> cell_case;
    // Bit y + 1 of rows[z + 1]: row (y, z) of samples is read by vertices of these cells or by
    // their gradients. Holds for the block's own edges too, unless the volume ends within the
    // block.
    std::array<uint16_t, 11> rows;
};
void find_cells(const Signs& signs, Last last, Cells& cells);

struct Count {
    std::array<uint16_t, 64> row_start; // vertices of the block before row (y, z), at y + 8 z
    uint32_t edge_vertices = 0;         // on the edges that the block owns
    uint32_t inner_vertices = 0;        // within its cells
    uint32_t triangles = 0;
    bool needs_values = false; // some cell's surface depends on values, in mode `correct`

    uint32_t vertices() const { return edge_vertices + inner_vertices; }
};
void count_edges(const Signs& signs, Last last, Count& count);
void count_cells(const Cells& cells, Count& count);
// Mode `correct`, where count_cells() found needs_values.
void count_correct_cells(const Cells& cells, const Samples& samples, float iso, Count& count);

// Numbers of the crossed edges that the block owns, in the order of their vertices. Returns how
// many.
int own_edges(const Signs& signs, Last last, uint16_t* numbers);

// A crossed edge of the block's cells that another block owns.
struct BorrowedEdge {
    uint16_t number;
    uint8_t owner;  // bit a: the next block along axis a
    uint8_t row;    // of its lower sample in that block, y + 8 z
    uint8_t in_row; // crossed edges that the owner's row has before it
};
int borrowed_edges(const Signs& signs, Last last, BorrowedEdge* edges);

// How a block lies in mesh space.
struct Place {
    glm::ivec3 origin; // sample of the volume that the block begins with
    glm::vec3 spacing_mm;
};

// Positions and, unless null, gradient normals of edges by number.
void make_vertices(const Samples& samples, const Place& place, float iso, const uint16_t* numbers,
                   int count, glm::vec3* positions, glm::vec3* normals);

// The triangles of all cells, in order. vertex_of_edge[number] is set for all their edges.
// Returns how many were written; there is room for them. In mode `correct`, inner vertices are
// written as well and numbered from first_inner.
struct Output {
    glm::uvec3* triangles;
    glm::vec3* inner_positions = nullptr;
    glm::vec3* inner_normals = nullptr; // null: none
    uint32_t first_inner = 0;
};
uint32_t make_triangles(const Cells& cells, const uint32_t* vertex_of_edge,
                        std::span<glm::uvec3> triangles);
uint32_t make_correct_triangles(const Cells& cells, const uint32_t* vertex_of_edge,
                                const Samples& samples, const Place& place, float iso,
                                const Output& out);

} // namespace palpate::block
