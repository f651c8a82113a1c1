#pragma once

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "engine/mesh/topology.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/trilinear_cell.h"
#include "engine/volume/builder.h"
#include "tests/unit/surface/trilinear_truth.h"

namespace palpate::testing {

// Ties made unequal as the engine promises to take them: as if iso were lower by less than anything
// that whole numbers of this size can tell apart.
inline Real untied(double value_minus_iso) {
    return static_cast<Real>(value_minus_iso) * 0x1p20L + 1.0L;
}

inline int parts_of(const std::array<int, 8>& classes, uint8_t inside, bool which) {
    std::set<int> distinct;
    for (int c = 0; c < 8; ++c)
        if ((inside >> c & 1) == which)
            distinct.insert(classes[c]);
    return static_cast<int>(distinct.size());
}

struct CellCheck {
    bool decided = true;
    bool has_tube = false;
};

// The cell's surface has the pieces of the trilinear interpolant: two loops bound one piece exactly
// if what lies inside of them is connected, and what lies outside. Each piece is a sphere with
// holes (a level set within a cell has no handles beyond that), so that the Euler number follows.
inline CellCheck check_cell(const CornerValues& values) {
    const uint8_t inside = inside_corners(values);
    std::array<Real, 8> d;
    for (int c = 0; c < 8; ++c)
        d[c] = values[c] == kNoData ? -0x1p40L : untied(values[c]);
    const auto truth = trilinear_truth(d);
    if (!truth)
        return {false};
    const std::array<int, 8> faces = boundary_truth(d);
    const uint8_t joined = joined_faces(inside, values);
    const CornerClasses on_faces = boundary_classes(inside, joined);
    const CornerClasses within = interior_classes(inside, on_faces, values);
    const auto loops = cell_loops(inside, joined);
    for (int c = 0; c < 8; ++c) {
        EXPECT_EQ(on_faces[c], faces[c]);
        EXPECT_EQ(within[c], (*truth)[c]);
    }
    const CellSurface surface = correct_table().needs_values(inside)
                                    ? correct_table().surface(inside, values)
                                    : fill_with_discs(loops);
    Union pieces(12 + surface.inner.size());
    std::set<std::pair<int, int>> sides;
    std::set<int> vertices;
    for (const auto& t : surface.triangles)
        for (int k = 0; k < 3; ++k) {
            pieces.join(t[k], t[(k + 1) % 3]);
            vertices.insert(t[k]);
            sides.insert(std::minmax<int>(t[k], t[(k + 1) % 3]));
        }
    std::set<size_t> distinct;
    for (const int v : vertices)
        distinct.insert(pieces.find(static_cast<size_t>(v)));
    const auto side_classes = [&](const CellLoop& loop) { // inner, outer
        const CellEdge e = cell_edge(loop[0]);
        const int low = e.corner, high = e.corner + (1 << e.axis);
        const bool low_inside = inside >> low & 1;
        return std::pair{(*truth)[low_inside ? low : high], (*truth)[low_inside ? high : low]};
    };
    for (const CellLoop& a : loops)
        for (const CellLoop& b : loops)
            EXPECT_EQ(pieces.find(a[0]) == pieces.find(b[0]), side_classes(a) == side_classes(b));
    if (!loops.empty()) {
        const int count = parts_of(*truth, inside, true) + parts_of(*truth, inside, false) - 1;
        EXPECT_EQ(static_cast<int>(distinct.size()), count);
        EXPECT_EQ(static_cast<int>(vertices.size()) - static_cast<int>(sides.size()) +
                      static_cast<int>(surface.triangles.size()),
                  2 * count - static_cast<int>(loops.size()));
    }
    return {true, *truth != faces};
}

struct CellTally {
    int undecided = 0, with_tube = 0;
};

// Corners by chance: numbers of many sizes, or whole numbers with many ties.
inline CellTally check_random_cells(int cells, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> real(-1.0, 1.0);
    CellTally tally;
    for (int i = 0; i < cells; ++i) {
        CornerValues values;
        const int kind = i % 4;
        for (double& v : values)
            v = kind == 0   ? std::round(real(random) * 4096.0)
                : kind == 1 ? static_cast<double>(random() % 5) - 2.0
                : kind == 2 ? static_cast<double>(random() % 21) - 10.0
                            : std::round(real(random) * real(random) * 4096.0);
        if (kind == 3) // opposite corners alike: where tubes are
            for (int c = 0; c < 4; ++c)
                values[7 - c] = values[c];
        const CellCheck check = check_cell(values);
        tally.undecided += !check.decided;
        tally.with_tube += check.has_tube;
        if (::testing::Test::HasFailure()) {
            ADD_FAILURE() << "cell " << i << " of seed " << seed;
            return tally;
        }
    }
    return tally;
}

// Betti numbers of the surface of a grid, by joining the cells' parts, held against those of the
// mesh: its pieces are one fewer than what it separates (all of space is connected), and its Euler
// number is the sum over cells, less lines on faces, plus points on edges.
inline bool check_random_grid(std::mt19937& random) {
    constexpr int kSide = 5, kPadded = kSide + 2;
    const int levels = 2 + static_cast<int>(random() % 6);
    std::vector<float> values(kSide * kSide * kSide);
    for (float& v : values)
        v = static_cast<float>(static_cast<int>(random() % static_cast<unsigned>(levels)) * 2);
    const float iso = static_cast<float>(random() % static_cast<unsigned>(2 * levels));
    const Volume volume = make_volume<float>(make_grid(glm::uvec3(kSide), {0.5, 1.0, 2.0}), values);

    const auto sample = [&](int x, int y, int z) -> std::optional<double> {
        if (std::min({x, y, z}) < 1 || std::max({x, y, z}) > kSide)
            return std::nullopt;
        return double{values[static_cast<size_t>(x - 1 + kSide * (y - 1 + kSide * (z - 1)))]} - iso;
    };
    const auto at = [](int x, int y, int z) {
        return static_cast<size_t>(x + kPadded * (y + kPadded * z));
    };
    Union parts(kPadded * kPadded * kPadded);
    int euler = 0;
    for (int z = 0; z + 1 < kPadded; ++z)
        for (int y = 0; y + 1 < kPadded; ++y)
            for (int x = 0; x + 1 < kPadded; ++x) {
                std::array<Real, 8> d;
                uint8_t inside = 0;
                for (int c = 0; c < 8; ++c) {
                    const auto v = sample(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
                    d[c] = v ? untied(*v) : -0x1p40L;
                    inside |= static_cast<uint8_t>((d[c] > 0) << c);
                }
                const std::array<int, 8> faces = boundary_truth(d);
                // The inside of a wall's cell clings to the samples' face, and the rest is one.
                const bool wall = std::min({x, y, z}) == 0 || std::max({x, y, z}) == kSide;
                const auto truth = wall ? std::optional(faces) : trilinear_truth(d);
                if (!truth)
                    return false;
                for (int c = 0; c < 8; ++c) {
                    const int b = (*truth)[c];
                    parts.join(at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)),
                               at(x + (b & 1), y + (b >> 1 & 1), z + (b >> 2)));
                }
                const int loops =
                    parts_of(faces, inside, true) + parts_of(faces, inside, false) - 1;
                const int pieces =
                    parts_of(*truth, inside, true) + parts_of(*truth, inside, false) - 1;
                euler += 2 * pieces - loops;
                // Crossed edges of the cell's three lower faces and its edges: each face and edge
                // once, for the padding is outside all around.
                for (int a = 0; a < 3; ++a) {
                    const int u = 1 << (a + 1) % 3, v = 1 << (a + 2) % 3;
                    const auto differ = [&](int p, int q) { return (d[p] > 0) != (d[q] > 0); };
                    euler -=
                        (differ(0, u) + differ(u, u + v) + differ(u + v, v) + differ(v, 0)) / 2;
                    euler += differ(0, 1 << a);
                }
            }
    std::set<size_t> distinct;
    for (size_t i = 0; i < static_cast<size_t>(kPadded * kPadded * kPadded); ++i)
        distinct.insert(parts.find(i));

    for (const SurfaceTopology mode : {SurfaceTopology::classic, SurfaceTopology::correct}) {
        const MeshTopology found =
            topology(marching_cubes(volume, iso, {.topology = mode, .closed_at_border = true}));
        EXPECT_TRUE(found.closed);
        EXPECT_TRUE(found.consistently_oriented);
        EXPECT_EQ(found.non_manifold_edges, 0u);
        EXPECT_EQ(found.duplicate_triangles, 0u);
        EXPECT_EQ(found.zero_area_triangles, 0u);
        EXPECT_EQ(found.degenerate_triangles, 0u);
        if (mode == SurfaceTopology::correct) {
            EXPECT_TRUE(found.manifold);
            EXPECT_EQ(found.components.size(), distinct.size() - 1);
            EXPECT_EQ(found.euler_number, euler);
        }
    }
    return true;
}

inline int check_random_grids(int grids, uint32_t seed) {
    std::mt19937 random(seed);
    int undecided = 0;
    for (int g = 0; g < grids; ++g) {
        undecided += !check_random_grid(random);
        if (::testing::Test::HasFailure()) {
            ADD_FAILURE() << "grid " << g << " of seed " << seed;
            break;
        }
    }
    return undecided;
}

} // namespace palpate::testing
