#include "engine/surface/block_parts.h"

namespace palpate::block {

namespace {

// The classic table with edges as differences of edge numbers.
struct NumberTable {
    std::array<uint8_t, 256> count;
    std::array<std::array<uint16_t, 3 * ClassicTable::kMaxTriangles + 1>, 256> edges{};
    std::array<bool, 256> needs_values;
};
const NumberTable& number_table() {
    static const NumberTable table = [] {
        NumberTable t;
        const ClassicTable& classic = classic_table();
        t.count = classic.triangle_count;
        for (int c = 0; c < 256; ++c) {
            for (int i = 0; i < 3 * t.count[c]; ++i)
                t.edges[c][i] = edge_differences()[classic.edges[c][i]];
            const auto inside = static_cast<uint8_t>(c); // as CorrectTable, which takes longer
            t.needs_values[c] = ambiguous_faces(inside) != 0 || cell_loops(inside, 0).size() > 1;
        }
        return t;
    }();
    return table;
}

} // namespace

const std::array<uint16_t, 12>& edge_differences() {
    static const std::array<uint16_t, 12> differences = [] {
        std::array<uint16_t, 12> made{};
        for (int e = 0; e < 12; ++e) {
            const CellEdge edge = cell_edge(e);
            made[e] = static_cast<uint16_t>(edge_number(edge.corner & 1, edge.corner >> 1 & 1,
                                                        edge.corner >> 2 & 1, edge.axis) -
                                            edge_number(0, 0, 0, 0));
        }
        return made;
    }();
    return differences;
}

void count_cells(const Cells& cells, Count& count) {
    const NumberTable& table = number_table();
    uint32_t triangles = 0;
    bool needs_values = false;
    for (int i = 0; i < cells.count; ++i) {
        triangles += table.count[cells.cell_case[i]];
        needs_values |= table.needs_values[cells.cell_case[i]];
    }
    count.triangles = triangles;
    count.inner_vertices = 0;
    count.needs_values = needs_values;
}

void count_correct_cells(const Cells& cells, const Samples& samples, float iso, Count& count) {
    const NumberTable& table = number_table();
    const CorrectTable& correct = correct_table();
    count.triangles = 0;
    count.inner_vertices = 0;
    for (int i = 0; i < cells.count; ++i) {
        const uint8_t cell_case = cells.cell_case[i];
        if (!table.needs_values[cell_case]) {
            count.triangles += table.count[cell_case];
            continue;
        }
        const CellSurface& surface = correct.surface(
            cell_case, corner_values(corners_of(samples, cells.first_edge[i]), iso));
        count.triangles += static_cast<uint32_t>(surface.triangles.size());
        count.inner_vertices += static_cast<uint32_t>(surface.inner.size());
    }
}

uint32_t make_triangles(const Cells& cells, const uint32_t* vertex_of_edge,
                        std::span<glm::uvec3> triangles) {
    const NumberTable& table = number_table();
    constexpr std::ptrdiff_t kMost = ClassicTable::kMaxTriangles;
    glm::uvec3* out = triangles.data();
    glm::uvec3* const end = out + triangles.size();
    for (int i = 0; i < cells.count; ++i) {
        const uint32_t* vertex = vertex_of_edge + cells.first_edge[i];
        const uint16_t* edge = table.edges[cells.cell_case[i]].data();
        const int n = table.count[cells.cell_case[i]];
        const auto put = [&](int t) {
            out[t] = {vertex[edge[3 * t]], vertex[edge[3 * t + 1]], vertex[edge[3 * t + 2]]};
        };
        if (end - out >= kMost) { // what is too much, the next cell writes over: fewer branches
            put(0);
            put(1);
            if (n > 2) {
                put(2);
                put(3);
                put(4);
            }
        } else {
            for (int t = 0; t < n; ++t)
                put(t);
        }
        out += n;
    }
    return static_cast<uint32_t>(out - triangles.data());
}

uint32_t make_correct_triangles(const Cells& cells, const uint32_t* vertex_of_edge,
                                const Samples& samples, const Place& place, float iso,
                                const Output& output) {
    const NumberTable& table = number_table();
    const CorrectTable& correct = correct_table();
    const glm::vec3 scale = 0.5f / place.spacing_mm;
    glm::uvec3* out = output.triangles;
    uint32_t inner_written = 0;
    for (int i = 0; i < cells.count; ++i) {
        const uint32_t* vertex = vertex_of_edge + cells.first_edge[i];
        const uint8_t cell_case = cells.cell_case[i];
        if (!table.needs_values[cell_case]) {
            const uint16_t* edge = table.edges[cell_case].data();
            for (int n = table.count[cell_case]; n > 0; --n, edge += 3)
                *out++ = {vertex[edge[0]], vertex[edge[1]], vertex[edge[2]]};
            continue;
        }
        const CellSurface& surface = correct.surface(
            cell_case, corner_values(corners_of(samples, cells.first_edge[i]), iso));
        const auto of = [&](uint8_t v) {
            return v < 12 ? vertex[edge_differences()[v]]
                          : output.first_inner + inner_written + (v - 12u);
        };
        for (const auto& t : surface.triangles)
            *out++ = {of(t[0]), of(t[1]), of(t[2])};
        for (const InnerVertex& inner : surface.inner) {
            const Crossing c = inner_crossing(inner, samples, sample_of(cells.first_edge[i]),
                                              place.origin, iso, scale);
            output.inner_positions[inner_written] = c.position * place.spacing_mm;
            if (output.inner_normals)
                output.inner_normals[inner_written] = c.normal;
            ++inner_written;
        }
    }
    return static_cast<uint32_t>(out - output.triangles);
}

} // namespace palpate::block
