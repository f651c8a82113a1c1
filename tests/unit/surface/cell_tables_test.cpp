#include "engine/surface/cell_tables.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <map>
#include <set>

#include "engine/surface/trilinear_cell.h"

namespace palpate {
namespace {

bool is_inside(int cell_case, int corner) {
    return cell_case >> corner & 1;
}

using Side = std::pair<int, int>; // directed, between vertices of the cell

// Sides of triangles that no triangle of the same cell runs along the other way.
std::multiset<Side> open_sides(const std::vector<std::array<uint8_t, 3>>& triangles) {
    std::multiset<Side> sides;
    for (const auto& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const Side back{t[(k + 1) % 3], t[k]};
            if (const auto found = sides.find(back); found != sides.end())
                sides.erase(found);
            else
                sides.insert({t[k], t[(k + 1) % 3]});
        }
    return sides;
}

std::vector<std::array<uint8_t, 3>> classic_triangles(int cell_case) {
    const ClassicTable& table = classic_table();
    std::vector<std::array<uint8_t, 3>> triangles(table.triangle_count[cell_case]);
    for (size_t t = 0; t < triangles.size(); ++t)
        std::copy_n(table.edges[cell_case].begin() + 3 * t, 3, triangles[t].begin());
    return triangles;
}

bool on_face(int vertex, int face) {
    return vertex < 12 && (faces_of_edge(vertex) >> face & 1);
}

// The open sides within a face, directed.
std::set<Side> sides_on_face(const std::vector<std::array<uint8_t, 3>>& triangles, int face) {
    std::set<Side> found;
    for (const Side& side : open_sides(triangles))
        if (on_face(side.first, face) && on_face(side.second, face)) {
            EXPECT_TRUE(found.insert(side).second);
        }
    return found;
}

// The edge of the upper neighbour along `axis` that is the edge `e` of this cell's upper face.
int seen_from_neighbour(int e, int axis) {
    const CellEdge edge = cell_edge(e);
    for (int other = 0; other < 12; ++other)
        if (cell_edge(other).axis == edge.axis &&
            cell_edge(other).corner == edge.corner - (1 << axis))
            return other;
    ADD_FAILURE();
    return -1;
}

TEST(CellTables, EdgesAndFacesAreThoseOfACube) {
    std::set<std::pair<int, int>> ends;
    for (int e = 0; e < 12; ++e) {
        const CellEdge edge = cell_edge(e);
        EXPECT_FALSE(edge.corner >> edge.axis & 1);
        ends.insert({edge.corner, edge.corner + (1 << edge.axis)});
        EXPECT_EQ(std::popcount(faces_of_edge(e)), 2);
        for (int f = 0; f < 6; ++f) {
            const auto corners = face_corners(f);
            const bool has_low = std::ranges::count(corners, edge.corner) > 0;
            const bool has_high = std::ranges::count(corners, edge.corner + (1 << edge.axis)) > 0;
            EXPECT_EQ(faces_of_edge(e) >> f & 1, has_low && has_high);
        }
    }
    EXPECT_EQ(ends.size(), 12u);
}

// Every crossed edge of a case is used, no other, and a cell's open sides lie in its faces.
TEST(CellTables, ClassicTrianglesUseTheCrossedEdgesAndEndAtFaces) {
    for (int c = 0; c < 256; ++c) {
        const auto triangles = classic_triangles(c);
        std::set<int> used;
        for (const auto& t : triangles)
            used.insert(t.begin(), t.end());
        for (int e = 0; e < 12; ++e) {
            const CellEdge edge = cell_edge(e);
            const bool crossed =
                is_inside(c, edge.corner) != is_inside(c, edge.corner + (1 << edge.axis));
            EXPECT_EQ(used.count(e) == 1, crossed) << "case " << c << " edge " << e;
        }
        for (const Side& side : open_sides(triangles))
            EXPECT_NE(faces_of_edge(side.first) & faces_of_edge(side.second), 0) << "case " << c;
    }
}

// All 256 cases beside all 16 cases that a neighbour across each of the three axes may have: what
// one leaves open in the shared face, the other runs along the other way. Sides within the face
// that are not open would be in three or four triangles.
TEST(CellTables, ClassicCellsCloseWithEveryNeighbour) {
    int pairs = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 256; ++c)
            for (int n = 0; n < 256; ++n) {
                bool fits = true;
                for (int corner = 0; corner < 8; ++corner)
                    if (corner >> axis & 1)
                        fits = fits && is_inside(c, corner) == is_inside(n, corner - (1 << axis));
                if (!fits)
                    continue;
                ++pairs;
                std::set<Side> back;
                for (const Side& s : sides_on_face(classic_triangles(c), 2 * axis + 1))
                    back.insert(
                        {seen_from_neighbour(s.second, axis), seen_from_neighbour(s.first, axis)});
                EXPECT_EQ(back, sides_on_face(classic_triangles(n), 2 * axis))
                    << "cases " << c << " and " << n << " along " << axis;
            }
    EXPECT_EQ(pairs, 3 * 256 * 16);
}

// The same for every way of deciding faces, discs and tubes: open sides are the lines of the faces,
// which depend on a face's corners and decision alone; sides that are not open leave the faces.
void expect_closes(const CellSurface& surface, const std::vector<CellLoop>& loops, int cell_case) {
    std::multiset<Side> lines;
    for (const CellLoop& loop : loops)
        for (size_t i = 0; i < loop.size(); ++i)
            lines.insert({loop[i], loop[(i + 1) % loop.size()]});
    EXPECT_EQ(open_sides(surface.triangles), lines) << "case " << cell_case;
    std::map<Side, int> uses;
    for (const auto& t : surface.triangles)
        for (int k = 0; k < 3; ++k) {
            EXPECT_NE(t[k], t[(k + 1) % 3]);
            ++uses[{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])}];
        }
    for (const auto& [side, count] : uses) {
        const bool line = lines.count(side) + lines.count({side.second, side.first}) > 0;
        EXPECT_EQ(count, line ? 1 : 2) << "case " << cell_case;
        if (!line && side.second < 12) {
            EXPECT_EQ(faces_of_edge(side.first) & faces_of_edge(side.second), 0)
                << "case " << cell_case << ": a diagonal across a face";
        }
    }
    for (const InnerVertex& v : surface.inner) {
        float sum = 0.0f;
        uint8_t all_faces = 0x3f;
        for (int e = 0; e < 12; ++e) {
            sum += v.weight[e];
            if (v.weight[e] > 0.0f)
                all_faces &= faces_of_edge(e);
        }
        EXPECT_NEAR(sum, 1.0f, 1e-6f);
        EXPECT_EQ(all_faces, 0) << "case " << cell_case << ": an inner vertex on a face";
    }
}

TEST(CellTables, EveryDecisionOfFacesClosesWithDiscsAndWithTubes) {
    size_t loops_seen = 0, with_centre = 0, tubes = 0;
    for (int c = 0; c < 256; ++c) {
        const auto inside = static_cast<uint8_t>(c);
        const uint8_t ambiguous = ambiguous_faces(inside);
        for (int joined = 0; joined < 64; ++joined) {
            if (joined & ~ambiguous)
                continue;
            const auto loops = cell_loops(inside, static_cast<uint8_t>(joined));
            loops_seen += loops.size();
            const CellSurface discs = fill_with_discs(loops);
            with_centre += discs.inner.size();
            expect_closes(discs, loops, c);
            for (size_t a = 0; a < loops.size(); ++a)
                for (size_t b = a + 1; b < loops.size(); ++b) {
                    expect_closes(fill_with_tube(loops, a, b), loops, c);
                    ++tubes;
                }
        }
    }
    EXPECT_GT(loops_seen, 256u);
    EXPECT_GT(with_centre, 0u);
    EXPECT_GT(tubes, 0u);
}

// The lines on a face are the same, run the other way, for the cell on its other side.
TEST(CellTables, LinesOfAFaceDependOnItsCornersAndDecisionAlone) {
    std::map<std::tuple<int, int, bool>, std::set<Side>> upper, lower; // axis, corners, joined
    for (int c = 0; c < 256; ++c)
        for (int joined = 0; joined < 64; ++joined) {
            const auto loops = cell_loops(static_cast<uint8_t>(c), static_cast<uint8_t>(joined));
            for (int face = 0; face < 6; ++face) {
                const int axis = face / 2;
                std::set<Side> lines;
                for (const CellLoop& loop : loops)
                    for (size_t i = 0; i < loop.size(); ++i) {
                        const int a = loop[i], b = loop[(i + 1) % loop.size()];
                        if (!(on_face(a, face) && on_face(b, face)))
                            continue;
                        lines.insert(face & 1 ? Side{seen_from_neighbour(b, axis),
                                                     seen_from_neighbour(a, axis)}
                                              : Side{a, b});
                    }
                int corners = 0;
                for (int corner = 0; corner < 8; ++corner)
                    if ((corner >> axis & 1) == (face & 1) && is_inside(c, corner))
                        corners |= 1 << (corner & ~(1 << axis));
                auto& of_side = face & 1 ? upper : lower;
                const auto [entry, is_new] =
                    of_side.insert({{axis, corners, joined >> face & 1}, lines});
                EXPECT_EQ(entry->second, lines) << "case " << c << " face " << face;
            }
        }
    EXPECT_EQ(upper, lower);
    EXPECT_EQ(upper.size(), 3u * 16u * 2u);
}

} // namespace
} // namespace palpate
