#include "engine/surface/block_mesh.h"

namespace palpate::block {

struct BlockMesher::Work {
    Samples samples;
    Cells cells;
    std::array<uint16_t, kMostEdges> edges;
    std::array<BorrowedEdge, kMostEdges> borrowed;
    std::array<uint32_t, kEdgeNumbers> vertex_of_edge;
    std::array<glm::vec3, kMostEdges + kMostInner> positions, normals;
    std::array<glm::uvec3, kMostTriangles> triangles;
};

void BlockMesher::Free::operator()(Work* work) const {
    delete work;
}

BlockMesher::BlockMesher() : work_(new Work) {
    classic_table(); // made now rather than within a deadline
    correct_table();
    Signs none{};
    Count count;
    find_cells(none, Last(8), work_->cells);
    count_cells(work_->cells, count);
}

Samples& BlockMesher::samples() {
    return work_->samples;
}

BlockMesher::Result BlockMesher::mesh(Last last, const Place& place, float iso,
                                      SurfaceTopology topology, bool with_normals) {
    Work& w = *work_;
    const Signs signs = signs_of(w.samples, iso);
    Result r;
    r.own_edges = own_edges(signs, last, w.edges.data());
    const int borrowed = borrowed_edges(signs, last, w.borrowed.data());
    if (r.own_edges + borrowed == 0)
        return r;
    Count count;
    find_cells(signs, last, w.cells);
    if (topology == SurfaceTopology::correct) {
        count_cells(w.cells, count);
        if (count.needs_values)
            count_correct_cells(w.cells, w.samples, iso, count);
    }
    r.inner = static_cast<int>(count.inner_vertices);
    r.vertices = r.own_edges + r.inner + borrowed;
    for (int i = 0; i < r.own_edges; ++i)
        w.vertex_of_edge[w.edges[i]] = static_cast<uint32_t>(i);
    for (int i = 0; i < borrowed; ++i) {
        w.edges[r.own_edges + i] = w.borrowed[i].number;
        w.vertex_of_edge[w.borrowed[i].number] = static_cast<uint32_t>(r.own_edges + r.inner + i);
    }
    glm::vec3* positions = w.positions.data();
    glm::vec3* normals = with_normals ? w.normals.data() : nullptr;
    const int first_borrowed = r.own_edges + r.inner;
    make_vertices(w.samples, place, iso, w.edges.data(), r.own_edges, positions, normals);
    make_vertices(w.samples, place, iso, w.edges.data() + r.own_edges, borrowed,
                  positions + first_borrowed, normals ? normals + first_borrowed : nullptr);
    if (count.needs_values)
        r.triangles = static_cast<int>(make_correct_triangles(
            w.cells, w.vertex_of_edge.data(), w.samples, place, iso,
            {w.triangles.data(), positions + r.own_edges, normals ? normals + r.own_edges : nullptr,
             static_cast<uint32_t>(r.own_edges)}));
    else
        r.triangles =
            static_cast<int>(make_triangles(w.cells, w.vertex_of_edge.data(), w.triangles));
    r.positions = positions;
    r.normals = normals;
    r.triangle = w.triangles.data();
    r.edges = w.edges.data();
    return r;
}

} // namespace palpate::block
