#include "engine/surface/cell_tables.h"

#include <algorithm>
#include <bit>
#include <glm/glm.hpp>
#include <limits>
#include <numeric>
#include <utility>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr int kNone = -1;

bool is_inside(uint8_t inside, int corner) {
    return inside >> corner & 1;
}

int edge_between(int a, int b) {
    const int low = std::min(a, b);
    const int axis = std::countr_zero(static_cast<unsigned>(a ^ b));
    for (int e = 4 * axis; e < 4 * axis + 4; ++e)
        if (cell_edge(e).corner == low)
            return e;
    PALPATE_ASSERT(false);
    return kNone;
}

// Twice the midpoint of an edge: whole numbers, so that lengths compare exactly.
glm::ivec3 doubled_midpoint(int e) {
    const CellEdge edge = cell_edge(e);
    glm::ivec3 p(2 * (edge.corner & 1), 2 * (edge.corner >> 1 & 1), 2 * (edge.corner >> 2 & 1));
    p[edge.axis] = 1;
    return p;
}

int squared_distance(int e, int f) {
    const glm::ivec3 d = doubled_midpoint(e) - doubled_midpoint(f);
    return d.x * d.x + d.y * d.y + d.z * d.z;
}

bool share_a_face(int e, int f) {
    return (faces_of_edge(e) & faces_of_edge(f)) != 0;
}

// The line that leaves face f from each crossed edge: next[from] = to. Seen from outside the face,
// a line starts where a walk about the face enters the inside, and ends where it leaves it.
void link_face(uint8_t inside, bool joined, int face, std::array<int, 12>& next) {
    const std::array<uint8_t, 4> corner = face_corners(face);
    std::array<int, 4> edge{}; // edge[i] between corners i and i + 1
    std::array<int, 4> enters{}, leaves{};
    int entries = 0, exits = 0;
    for (int i = 0; i < 4; ++i) {
        const bool here = is_inside(inside, corner[i]);
        const bool there = is_inside(inside, corner[(i + 1) % 4]);
        edge[i] = edge_between(corner[i], corner[(i + 1) % 4]);
        if (!here && there)
            enters[entries++] = i;
        if (here && !there)
            leaves[exits++] = i;
    }
    PALPATE_ASSERT(entries == exits);
    for (int k = 0; k < entries; ++k) {
        const int from = enters[k];
        int to = leaves[0];
        if (entries == 2) // about the inside corner that follows, or the outside one before
            to = joined ? (from + 3) % 4 : (from + 1) % 4;
        next[edge[from]] = edge[to];
    }
}

void merge(CornerClasses& classes, int a, int b) {
    const uint8_t from = std::max(classes[a], classes[b]), to = std::min(classes[a], classes[b]);
    std::replace(classes.begin(), classes.end(), from, to);
}

// The triangulation of a loop with the shortest diagonals, none across a face; false where there is
// none. Appends to `triangles`.
bool triangulate(const CellLoop& loop, std::vector<std::array<uint8_t, 3>>& triangles) {
    constexpr int kForbidden = std::numeric_limits<int>::max() / 4;
    const int n = static_cast<int>(loop.size());
    const auto length = [&](int i, int j) {
        if (j == i + 1 || (i == 0 && j == n - 1))
            return 0;
        return share_a_face(loop[i], loop[j]) ? kForbidden : squared_distance(loop[i], loop[j]);
    };
    // cost[i][j]: of the polygon i, i + 1 .. j, closed by the side j i; apex[i][j] completes that
    // side to a triangle.
    std::vector cost(n, std::vector<int>(n, 0)), apex(n, std::vector<int>(n, kNone));
    for (int span = 2; span < n; ++span)
        for (int i = 0; i + span < n; ++i) {
            const int j = i + span;
            cost[i][j] = kForbidden;
            for (int k = i + 1; k < j; ++k) {
                const int total = std::min(kForbidden, cost[i][k] + cost[k][j] + length(i, j));
                if (total < cost[i][j]) {
                    cost[i][j] = total;
                    apex[i][j] = k;
                }
            }
        }
    if (cost[0][n - 1] >= kForbidden)
        return false;
    std::vector<std::array<int, 2>> open{{0, n - 1}};
    while (!open.empty()) {
        const auto [i, j] = open.back();
        open.pop_back();
        if (j - i < 2)
            continue;
        const int k = apex[i][j];
        triangles.push_back({loop[i], loop[k], loop[j]});
        open.push_back({k, j});
        open.push_back({i, k});
    }
    return true;
}

void add_disc(const CellLoop& loop, CellSurface& surface) {
    if (triangulate(loop, surface.triangles))
        return;
    const auto centre = static_cast<uint8_t>(12 + surface.inner.size());
    InnerVertex mean;
    for (size_t i = 0; i < loop.size(); ++i) {
        mean.weight[loop[i]] = 1.0f / static_cast<float>(loop.size());
        surface.triangles.push_back({loop[i], loop[(i + 1) % loop.size()], centre});
    }
    surface.inner.push_back(mean);
}

// Joins loop a to a ring of as many inner vertices, and that to loop b. The two loops run opposite
// ways about the tube; steps[j] is the vertex of a that faces vertex j of the reversed b.
void add_tube(const CellLoop& a, const CellLoop& b_reversed, CellSurface& surface) {
    const int m = static_cast<int>(a.size()), n = static_cast<int>(b_reversed.size());
    // Vertex shift + j of b faces vertex j * m / n of a: the shift with the shortest cross lines.
    const auto facing = [&](int j) { return j * m / n; };
    int best = 0, best_cost = std::numeric_limits<int>::max();
    for (int shift = 0; shift < n; ++shift) {
        int cost = 0;
        for (int j = 0; j < n; ++j)
            cost += squared_distance(a[facing(j)], b_reversed[(shift + j) % n]);
        if (cost < best_cost) {
            best_cost = cost;
            best = shift;
        }
    }
    const auto b = [&](int j) { return b_reversed[(best + j) % n]; };
    const auto first = static_cast<uint8_t>(12 + surface.inner.size());
    const auto ring = [&](int i) { return static_cast<uint8_t>(first + i % m); };
    for (int i = 0; i < m; ++i) {
        // A quarter each from the two loops, and half from the middle of both.
        InnerVertex v;
        for (int k = 0; k < m; ++k)
            v.weight[a[k]] += 0.25f / static_cast<float>(m);
        for (int j = 0; j < n; ++j)
            v.weight[b(j)] += 0.25f / static_cast<float>(n);
        v.weight[a[i]] += 0.25f;
        int faced = 0;
        for (int j = 0; j < n; ++j)
            faced += facing(j) == i;
        for (int j = 0; j < n; ++j)
            if (facing(j) == i)
                v.weight[b(j)] += 0.25f / static_cast<float>(faced);
        surface.inner.push_back(v);
        surface.triangles.push_back({a[i], a[(i + 1) % m], ring(i)});
        surface.triangles.push_back({a[(i + 1) % m], ring(i + 1), ring(i)});
    }
    for (int j = 0; j < n; ++j) {
        const int here = facing(j), there = j + 1 < n ? facing(j + 1) : m;
        surface.triangles.push_back({ring(here), b(j + 1), b(j)});
        if (there != here)
            surface.triangles.push_back({ring(here), ring(there), b(j + 1)});
    }
}

ClassicTable make_classic_table() {
    ClassicTable table;
    for (int inside = 0; inside < 256; ++inside) {
        const CellSurface surface =
            fill_with_discs(cell_loops(static_cast<uint8_t>(inside), /*joined=*/0));
        PALPATE_ASSERT(surface.inner.empty());
        PALPATE_ASSERT_CMP(surface.triangles.size(), <=, ClassicTable::kMaxTriangles);
        table.triangle_count[inside] = static_cast<uint8_t>(surface.triangles.size());
        for (size_t t = 0; t < surface.triangles.size(); ++t)
            for (size_t k = 0; k < 3; ++k)
                table.edges[inside][3 * t + k] = surface.triangles[t][k];
    }
    return table;
}

} // namespace

uint8_t faces_of_edge(int edge) {
    const CellEdge e = cell_edge(edge);
    uint8_t faces = 0;
    for (int axis = 0; axis < 3; ++axis)
        if (axis != e.axis)
            faces |= static_cast<uint8_t>(1 << (2 * axis + (e.corner >> axis & 1)));
    return faces;
}

std::array<uint8_t, 4> face_corners(int face) {
    const int axis = face / 2, side = face & 1;
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3; // u x v = axis
    const int base = side << axis;
    std::array<uint8_t, 4> corners{};
    const std::array<int, 4> upper{base, base + u, base + u + v, base + v};
    for (int i = 0; i < 4; ++i)
        corners[i] = static_cast<uint8_t>(side ? upper[i] : upper[3 - i]);
    return corners;
}

uint8_t ambiguous_faces(uint8_t inside) {
    uint8_t faces = 0;
    for (int f = 0; f < 6; ++f) {
        const std::array<uint8_t, 4> c = face_corners(f);
        const bool first = is_inside(inside, c[0]), second = is_inside(inside, c[1]);
        if (first != second && first == is_inside(inside, c[2]) &&
            second == is_inside(inside, c[3]))
            faces |= static_cast<uint8_t>(1 << f);
    }
    return faces;
}

std::vector<CellLoop> cell_loops(uint8_t inside, uint8_t joined) {
    std::array<int, 12> next;
    next.fill(kNone);
    for (int f = 0; f < 6; ++f)
        link_face(inside, joined >> f & 1, f, next);
    std::vector<CellLoop> loops;
    for (int start = 0; start < 12; ++start) {
        if (next[start] == kNone)
            continue;
        CellLoop loop;
        for (int e = start; next[e] != kNone;) {
            loop.push_back(static_cast<uint8_t>(e));
            e = std::exchange(next[e], kNone);
        }
        loops.push_back(std::move(loop));
    }
    return loops;
}

CornerClasses boundary_classes(uint8_t inside, uint8_t joined) {
    CornerClasses classes;
    std::iota(classes.begin(), classes.end(), uint8_t{0});
    for (int e = 0; e < 12; ++e) {
        const int a = cell_edge(e).corner, b = a + (1 << cell_edge(e).axis);
        if (is_inside(inside, a) == is_inside(inside, b))
            merge(classes, a, b);
    }
    const uint8_t ambiguous = ambiguous_faces(inside);
    for (int f = 0; f < 6; ++f)
        if (ambiguous >> f & 1) {
            const std::array<uint8_t, 4> c = face_corners(f);
            const bool first = is_inside(inside, c[0]) == ((joined >> f & 1) != 0);
            merge(classes, c[first ? 0 : 1], c[first ? 2 : 3]);
        }
    return classes;
}

CellSurface fill_with_discs(const std::vector<CellLoop>& loops) {
    CellSurface surface;
    for (const CellLoop& loop : loops)
        add_disc(loop, surface);
    return surface;
}

CellSurface fill_with_tube(const std::vector<CellLoop>& loops, size_t a, size_t b) {
    PALPATE_ASSERT(a != b && a < loops.size() && b < loops.size());
    CellSurface surface;
    for (size_t i = 0; i < loops.size(); ++i)
        if (i != a && i != b)
            add_disc(loops[i], surface);
    const bool a_is_shorter = loops[a].size() <= loops[b].size();
    const CellLoop& near = loops[a_is_shorter ? a : b];
    CellLoop far = loops[a_is_shorter ? b : a];
    std::reverse(far.begin(), far.end());
    add_tube(near, far, surface);
    return surface;
}

const ClassicTable& classic_table() {
    static const ClassicTable table = make_classic_table();
    return table;
}

} // namespace palpate
