#include "engine/segment/simplex_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "engine/mesh/self_intersections.h"
#include "engine/mesh/topology.h"
#include "engine/segment/mesh_fit.h"
#include "engine/segment/methods.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/synthetic.h"
#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

void run(SimplexMesh& mesh, const SimplexForce& force, int steps, const SimplexOptions& options) {
    for (int i = 0; i < steps; ++i)
        simplex_step(mesh, force, {}, options);
}

Volume distance_of(const Grid& grid, const std::function<bool(glm::dvec3 mm)>& inside) {
    const Volume mask = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return inside(world_point(grid, glm::dvec3(i))) ? 1.0 : 0.0;
    });
    return signed_distance(mask, {}, {}).value();
}

TEST(SimplexMesh, IsTheDualOfItsTriangles) {
    for (const int level : {0, 1, 3}) {
        const SimplexMesh mesh = simplex_ellipsoid({1, 2, 3}, {5, 5, 5}, level);
        EXPECT_EQ(mesh.positions.size(), size_t{20} << (2 * level));
        EXPECT_EQ(euler_number(mesh), 2);
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const glm::dvec3 out = glm::normalize(mesh.positions[v] - glm::dvec3(1, 2, 3));
            EXPECT_GT(glm::dot(normal_at(mesh, v), out), 0.9);
            for (int k = 0; k < 3; ++k) { // neighbours are mutual
                const glm::uvec3 back = mesh.neighbours[mesh.neighbours[v][k]];
                EXPECT_TRUE(back.x == v || back.y == v || back.z == v);
            }
        }
        const MeshTopology found = topology(triangles_of(mesh));
        EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
        EXPECT_EQ(found.euler_number, 2);
        EXPECT_GT(found.volume_mm3, 0.0);
    }
    Mesh open;
    open.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    open.triangles = {{0, 1, 2}};
    EXPECT_FALSE(simplex_mesh(open));
}

// Vertices on a sphere have its curvature, whatever their distances.
TEST(SimplexMesh, CurvatureOnASphereIsThatOfTheSphere) {
    SimplexMesh mesh = simplex_ellipsoid({0, 0, 0}, {1, 1, 1}, 3);
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0.0, 0.01);
    for (glm::dvec3& p : mesh.positions)
        p = 7.0 * glm::normalize(p + glm::dvec3(noise(random), noise(random), noise(random)));
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        EXPECT_NEAR(curvature_at(mesh, v), 1.0 / 7.0, 1e-9);
}

TEST(SimplexMesh, ASphereStaysASphereWithoutForces) {
    for (const uint32_t rigidity : {0u, 1u, 8u}) {
        SimplexMesh mesh = simplex_ellipsoid({10, 0, -5}, {20, 20, 20}, 3);
        run(mesh, {}, 200, {.rigidity = rigidity});
        glm::dvec3 center(0.0);
        for (const glm::dvec3 p : mesh.positions)
            center += p / double(mesh.positions.size());
        EXPECT_LT(glm::distance(center, {10, 0, -5}), 1e-6);
        for (const glm::dvec3 p : mesh.positions)
            EXPECT_NEAR(glm::distance(p, center), 20.0, 0.02); // 0.1 %
    }
}

TEST(SimplexMesh, ReachesAnEllipsoidWithinAQuarterOfAVoxel) {
    const Grid grid = make_grid({80, 70, 60}, {1, 1, 1}, {-40, -35, -30});
    const glm::dvec3 semi(30, 22, 16);
    const Volume away =
        distance_of(grid, [&](glm::dvec3 p) { return glm::length(p / semi) <= 1.0; });
    SimplexMesh mesh = simplex_ellipsoid({0, 0, 0}, {14, 14, 14}, 4);
    run(mesh, toward_surface(away), 500, {.rigidity = 1});
    double sum = 0.0, largest = 0.0;
    for (const glm::dvec3 p : mesh.positions) {
        // First order: the level of the ellipsoid's function over the length of its gradient.
        const double level = glm::length(p / semi);
        const double off = std::abs(level - 1.0) * level / glm::length(p / (semi * semi));
        sum += off;
        largest = std::max(largest, off);
    }
    EXPECT_LT(sum / double(mesh.positions.size()), 0.25);
    EXPECT_LT(largest, 1.0);
    EXPECT_TRUE(self_intersections(triangles_of(mesh)).empty());
    EXPECT_EQ(euler_number(mesh), 2);
}

// Figure 10 of Nystroem et al. 2008: a ball of 20 mm, and a hole of 3.5 mm through which fast
// marching runs on into another ball, up to 59 mm.
//
// How far the mesh can follow: its 5120 vertices are edges of e = 0.87 mm apart on the ball. At
// rest the internal force balances the external one, which is cut at 0.3 e: no vertex is more than
// (0.1 / 0.5) 0.3 e = 0.052 mm over its aim. The height over the neighbours' plane is H e^2 / 2, so
// its mean curvature H exceeds the evened one by at most 0.14 / mm. 16 passes of a mean over three
// neighbours even H over a deviation of s = sqrt(16 * 3/4 / 2) e = 2.1 mm. A bump of height b and
// width w has H = b / w^2 at its top, and b w^2 / (w^2 + s^2)^2 when evened; the force acts in the
// hole alone, so w <= 3.5 mm, and b <= 3.6 mm.
TEST(SimplexMesh, DoesNotFollowTheLeakOfFastMarching) {
    const Grid grid = make_grid({96, 64, 64}, {1, 1, 1}, {-32, -32, -32});
    const Volume grey = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        const bool hole = p.x > 0 && p.x < 44 && std::hypot(p.y, p.z) <= 3.5;
        return glm::length(p) <= 20.0 || hole || glm::distance(p, {50, 0, 0}) <= 9.0 ? 100.0 : 0.0;
    });
    const SeedBall ball[] = {{1, {0, 0, 0}, 6.0}};
    const Result<Segmented> leaked =
        segment(*find_segment_method("fast-marching"),
                {grey, *seed_map(grey, ball), {std::begin(ball), std::end(ball)}, 0},
                {{"threshold", 2.0}}, {});
    ASSERT_TRUE(leaked) << leaked.error().message;
    EXPECT_EQ(leaked->labels.value({88, 32, 32}), 1.0f); // (56, 0, 0)
    const MeshFitOptions options{.simplex = {.external = 0.1, .rigidity = 16}};
    const Result<MeshFit> fit = fit_mesh(grey, leaked->labels, options, {});
    ASSERT_TRUE(fit) << fit.error().message;
    double farthest = 0.0, off = 0.0;
    for (const glm::dvec3 p : fit->mesh.positions) {
        farthest = std::max(farthest, p.x);
        off += std::abs(glm::length(p) - 20.0) / double(fit->mesh.positions.size());
    }
    EXPECT_LT(farthest, 20.0 + 3.6);
    // Elsewhere it is the ball, less what the front leaves: values are smoothed over a sample to
    // each side, so it stops up to a diagonal and a half sample before the edge.
    EXPECT_LT(off, std::sqrt(3.0) + 0.5);
    EXPECT_EQ(fit->labels.value({88, 32, 32}), 0.0f);
    EXPECT_EQ(fit->self_intersections, 0u);
    EXPECT_EQ(topology(triangles_of(fit->mesh)).euler_number, 2);
}

TEST(SimplexMesh, FindsEdgesOfGreyValues) {
    const Grid grid = make_grid({60, 60, 60}, {1, 1, 1}, {-30, -30, -30});
    const Volume ball = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return 100.0 / (1.0 + std::exp(glm::length(world_point(grid, glm::dvec3(i))) - 18.0));
    });
    SimplexMesh mesh = simplex_ellipsoid({0, 0, 0}, {15, 15, 15}, 3);
    run(mesh, toward_edges(ball, 6.0), 200, {.rigidity = 4});
    for (const glm::dvec3 p : mesh.positions)
        EXPECT_NEAR(glm::length(p), 18.0, 0.5); // the search goes in steps of half a sample
}

TEST(SimplexMesh, IsTheSameForAnyOrderOfVertices) {
    const Grid grid = make_grid({50, 50, 50}, {1, 1, 1}, {-25, -25, -25});
    const Volume away = distance_of(
        grid, [](glm::dvec3 p) { return glm::length(p / glm::dvec3(18, 14, 11)) <= 1.0; });
    SimplexMesh mesh = simplex_ellipsoid({0, 0, 0}, {9, 9, 9}, 2), other = mesh;
    std::vector<uint32_t> to(mesh.positions.size());
    std::iota(to.begin(), to.end(), 0u);
    std::shuffle(to.begin(), to.end(), std::mt19937(5));
    for (size_t v = 0; v < to.size(); ++v) {
        other.positions[to[v]] = other.before[to[v]] = mesh.positions[v];
        const glm::uvec3 n = mesh.neighbours[v];
        other.neighbours[to[v]] = {to[n.x], to[n.y], to[n.z]};
    }
    for (uint32_t& v : other.face_vertices)
        v = to[v];
    run(mesh, toward_surface(away), 50, {});
    run(other, toward_surface(away), 50, {});
    for (size_t v = 0; v < to.size(); ++v)
        EXPECT_EQ(mesh.positions[v], other.positions[to[v]]);
}

TEST(SimplexMesh, APullMovesItsPatchAndTheRestFollowsBack) {
    SimplexMesh mesh = simplex_ellipsoid({0, 0, 0}, {20, 20, 20}, 3);
    const std::vector<uint32_t> patch = patch_of_faces(mesh, 7, 2);
    EXPECT_GT(patch.size(), 10u);
    const uint32_t vertex = mesh.face_vertices[mesh.face_first[7]];
    const glm::dvec3 out = glm::normalize(mesh.positions[vertex]);
    const SimplexPull pull{patch, 0.5 * out};
    for (int i = 0; i < 60; ++i)
        simplex_step(mesh, {}, {&pull, 1}, {.rigidity = 2});
    EXPECT_GT(glm::dot(mesh.positions[vertex], out), 22.0);
    EXPECT_EQ(topology(triangles_of(mesh)).euler_number, 2);
    EXPECT_TRUE(self_intersections(triangles_of(mesh)).empty());
    const SimplexPull through{patch, -60.0 * out}; // drawn through the other side it cuts it
    for (int i = 0; i < 200; ++i)
        simplex_step(mesh, {}, {&through, 1}, {.rigidity = 2});
    EXPECT_FALSE(self_intersections(triangles_of(mesh)).empty());
}

// Points of fans of triangles by the solid angle they are seen under: 4 pi inside, 0 outside.
bool is_inside(const Mesh& mesh, glm::dvec3 world) {
    const glm::dvec3 p = world - glm::dvec3(mesh.world_from_mesh[3]);
    double sum = 0.0;
    for (const glm::uvec3 t : mesh.triangles) {
        const glm::dvec3 a = glm::dvec3(mesh.positions[t.x]) - p,
                         b = glm::dvec3(mesh.positions[t.y]) - p,
                         c = glm::dvec3(mesh.positions[t.z]) - p;
        const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
        sum += 2.0 * std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                                   glm::dot(b, c) * la +
                                                                   glm::dot(c, a) * lb);
    }
    return sum > 2.0 * M_PI;
}

TEST(SimplexMesh, IsRasterisedToTheSamplesInside) {
    SimplexMesh mesh = simplex_ellipsoid({0.3, 0.1, -0.2}, {9, 7, 5}, 2);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> stretch(0.85, 1.15);
    for (glm::dvec3& p : mesh.positions)
        p *= stretch(random);
    Grid grid = make_grid({26, 20, 12}, {0.9, 0.9, 1.3}, {-11, -8, -7});
    grid.world_from_index[1][0] = 0.2; // slanted: inside is inside
    const Mesh triangles = triangles_of(mesh);
    for (const uint16_t label : {uint16_t{5}, uint16_t{700}}) {
        const Result<Volume> made = rasterised(mesh, grid, label, {});
        ASSERT_TRUE(made);
        for (size_t n = 0; n < sample_count(grid); ++n) {
            const glm::uvec3 i = index_of(grid.size, n);
            EXPECT_EQ(made->value(i),
                      is_inside(triangles, world_point(grid, glm::dvec3(i))) ? float(label) : 0.0f);
        }
    }
}

// Lines through vertices and along edges: of a box on whole numbers every sample is on one side.
TEST(SimplexMesh, RasterisedOnItsOwnVerticesItIsStillWhole) {
    Mesh box; // 0 .. 4 on every axis
    for (int i = 0; i < 8; ++i)
        box.positions.emplace_back(4.0f * (i & 1), 4.0f * (i >> 1 & 1), 4.0f * (i >> 2));
    box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    SimplexMesh mesh = simplex_mesh(box).value();
    for (glm::dvec3& p : mesh.positions)
        p = glm::round(p); // corners of the dual on samples
    const Result<Volume> made =
        rasterised(mesh, make_grid({9, 9, 9}, {1, 1, 1}, {-2, -2, -2}), 1, {});
    uint64_t runs = 0;
    for (uint32_t z = 0; z < 9; ++z)
        for (uint32_t y = 0; y < 9; ++y) {
            EXPECT_EQ(made->value({0, y, z}), 0.0f);
            EXPECT_EQ(made->value({8, y, z}), 0.0f); // every line leaves what it enters
            for (uint32_t x = 0; x < 9; ++x)
                runs += made->value({x, y, z}) != 0.0f;
        }
    EXPECT_GT(runs, 0u);
}

} // namespace
} // namespace palpate
