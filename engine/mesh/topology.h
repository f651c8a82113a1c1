#pragma once

#include <cstdint>
#include <vector>

#include "engine/mesh/mesh.h"

namespace palpate {

// One piece of a mesh: triangles joined by common vertices.
struct MeshComponent {
    uint64_t triangles = 0;
    uint64_t vertices = 0;    // positions that its triangles use
    int64_t euler_number = 0; // vertices - edges + triangles: 2 a ball, 0 a torus, 1 a disk
    double area_mm2 = 0.0;
    double volume_mm3 = 0.0; // enclosed; negative where it is a hollow, its normals facing inward
};

// Topology and size of a mesh. Lengths are world millimetres, computed in double. Vertices are the
// same where their index is the same: weld() first where positions should count. Triangles that
// name one vertex twice are counted in degenerate_triangles and otherwise left out. Shared walls
// enclose the sum of their labels' volumes, 0 apart, each in its own closed surface. The volume of
// a mesh that is not closed is not defined: it is taken from the middle of the positions' box.
struct MeshTopology {
    std::vector<MeshComponent> components; // in the order of their first triangles
    uint64_t triangles = 0;                // of the components
    uint64_t vertices = 0;
    int64_t euler_number = 0; // the sum over the components
    double area_mm2 = 0.0;
    double volume_mm3 = 0.0;

    uint64_t open_edges = 0;            // in one triangle
    uint64_t non_manifold_edges = 0;    // in three triangles or more
    uint64_t misoriented_edges = 0;     // in two or more, not run along equally often both ways
    uint64_t non_manifold_vertices = 0; // whose triangles form more than one fan
    uint64_t duplicate_triangles = 0;   // with the three vertices of an earlier one
    uint64_t zero_area_triangles = 0;   // corners in one line, to the rounding of double
    uint64_t degenerate_triangles = 0;

    bool closed = true;                // no open edge; so is a mesh without triangles
    bool manifold = true;              // no non-manifold edge or vertex, no degenerate triangle
    bool consistently_oriented = true; // no misoriented edge
};

// Triangles and labels are read; normals are not. Triangles may be in any order: every figure but
// the rounding of area and volume is the same.
MeshTopology topology(const Mesh& mesh);

// The same mesh with one vertex for each distinct position (-0 is 0): the first of those that share
// it, with its normal. Triangles keep their order and labels; none is dropped.
Mesh weld(const Mesh& mesh);

// Unit normals: at each position the sum of its triangles' normals, weighted by area. (0, 0, 0)
// where they cancel or there is no triangle.
std::vector<glm::vec3> vertex_normals(const Mesh& mesh);

// For every position, the triangles that use it, in rising order: those of position v are
// triangles[first[v]] up to triangles[first[v + 1] - 1].
struct TrianglesOfVertex {
    std::vector<uint32_t> first; // one more than positions
    std::vector<uint32_t> triangles;
};
TrianglesOfVertex triangles_of_vertices(const Mesh& mesh);

} // namespace palpate
