#pragma once

#include <cstdint>
#include <vector>

#include "engine/mesh/mesh.h"
#include "engine/mesh/topology.h"
#include "engine/mesh/triangle_tree.h"

namespace palpate {

// A mesh as decimation sees it. World axes in millimetres about an origin near the mesh, so that
// doubles lose nothing far from the world's origin. A patch is all triangles with one label and one
// outer label; a mesh without labels is one patch.
struct CollapseSource {
    explicit CollapseSource(const Mesh& mesh);

    const Mesh& mesh;
    glm::dmat4 local_from_mesh;
    std::vector<glm::dvec3> points; // local, one a position
    std::vector<uint32_t> patch;    // of each triangle
    std::vector<std::vector<uint32_t>> triangles_of_patch;
    std::vector<TriangleTree> trees; // of each patch, in local axes
    TrianglesOfVertex incident;
    double edge_mm = 0.0; // mean length
};

} // namespace palpate
