#include "engine/mesh/distance.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

Mesh shifted(Mesh mesh, glm::dvec3 by) {
    mesh.world_from_mesh = glm::translate(mesh.world_from_mesh, by);
    return mesh;
}

glm::dvec3 any_point(std::mt19937& random, double half) {
    std::uniform_real_distribution<double> uniform(-half, half);
    const double x = uniform(random), y = uniform(random);
    return {x, y, uniform(random)};
}

TEST(NearestPoint, EqualsTheBestOfManyPointsOfTheTriangle) {
    std::mt19937 random(2);
    for (int round = 0; round < 300; ++round) {
        std::array<glm::dvec3, 3> t{any_point(random, 1), any_point(random, 1),
                                    any_point(random, 1)};
        if (round % 10 == 0)
            t[2] = 0.5 * (t[0] + t[1]); // flat
        if (round % 30 == 0)
            t[1] = t[0]; // and shorter
        const glm::dvec3 p = any_point(random, 2);
        const double found = glm::length(nearest_point(p, t) - p);
        const int cuts = 64;
        double best = 1e9;
        for (int i = 0; i <= cuts; ++i)
            for (int j = 0; i + j <= cuts; ++j)
                best = std::min(best, glm::length(t[0] + double(i) / cuts * (t[1] - t[0]) +
                                                  double(j) / cuts * (t[2] - t[0]) - p));
        ASSERT_LE(found, best + 1e-12);
        // No point of the triangle is farther than the longest side over `cuts` from a grid point.
        const double side = std::max(
            {glm::length(t[0] - t[1]), glm::length(t[1] - t[2]), glm::length(t[2] - t[0])});
        ASSERT_GE(found, best - side / cuts) << round;
    }
}

TEST(TriangleTree, FindsWhatASearchOfAllTrianglesFinds) {
    std::mt19937 random(3);
    for (const uint32_t count : {0u, 1u, 4u, 5u, 9u, 1000u}) {
        Mesh mesh;
        for (uint32_t n = 0; n < count; ++n) {
            const glm::dvec3 at = any_point(random, 10);
            for (int i = 0; i < 3; ++i)
                mesh.positions.emplace_back(at + any_point(random, 1));
            mesh.triangles.emplace_back(3 * n, 3 * n + 1, 3 * n + 2);
        }
        mesh.world_from_mesh = glm::scale(glm::dmat4(1.0), glm::dvec3(1.0, -0.5, 3.0));
        const TriangleTree tree(mesh);
        for (int round = 0; round < 200; ++round) {
            const glm::dvec3 p = any_point(random, 20);
            double best = std::numeric_limits<double>::infinity();
            for (uint32_t n = 0; n < count; ++n)
                best = std::min(best, glm::length(nearest_point(p, tree.corners(n)) - p));
            const TriangleTree::Nearest found = tree.nearest(p);
            ASSERT_EQ(found.distance_mm, best);
            ASSERT_EQ(found.triangle == ~0u, count == 0);
        }
    }
}

TEST(CompareMeshes, OfOneMeshIsZero) {
    const Mesh mesh = meshes::torus(24, 12, 10, 3);
    const MeshDistance found = compare_meshes(mesh, mesh, {.samples = 5000});
    // A point of a triangle, put together from its corners, is off its plane by rounding alone.
    EXPECT_LT(found.hausdorff_mm(), 1e-14);
    EXPECT_LT(found.rms_mm(), 1e-14);
    EXPECT_EQ(found.forward.normal_max_deg, 0.0);
    EXPECT_GE(found.forward.samples, 5000u);
}

// Two parallel squares 1 x 1, the second 0.25 mm above and of half the side, about the same centre.
TEST(CompareMeshes, KnowsTheFarthestPointBetweenVertices) {
    const auto square = [](float half, float z) {
        return Mesh{
            .positions = {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}},
            .triangles = {{0, 1, 2}, {0, 2, 3}}};
    };
    const MeshDistance found = compare_meshes(square(0.5f, 0.0f), square(0.25f, 0.25f));
    // From a corner to the other's corner.
    EXPECT_DOUBLE_EQ(found.forward.largest_mm, std::sqrt(3 * 0.0625));
    EXPECT_DOUBLE_EQ(found.backward.largest_mm, 0.25);
    EXPECT_DOUBLE_EQ(found.backward.mean_mm, 0.25);
    EXPECT_DOUBLE_EQ(found.hausdorff_mm(), found.forward.largest_mm);
    EXPECT_EQ(found.forward.normal_max_deg, 0.0);

    // A roof over a square: all its corners lie on the square, its ridge is 1 mm up. Seen from the
    // square the farthest point is the one below the ridge, where no vertex is: 1 mm high and 1 mm
    // from the eaves, so 1/sqrt(2) from either slope.
    const Mesh roof{
        .positions = {{-1, -9, 0}, {1, -9, 0}, {0, -9, 1}, {-1, 9, 0}, {1, 9, 0}, {0, 9, 1}},
        .triangles = {{0, 2, 5}, {0, 5, 3}, {1, 4, 5}, {1, 5, 2}}};
    const Mesh floor{.positions = {{-1, -9, 0}, {1, -9, 0}, {1, 9, 0}, {-1, 9, 0}},
                     .triangles = {{0, 1, 2}, {0, 2, 3}}};
    const DistanceOptions options{.tolerance_mm = 1e-4, .samples = 1000};
    const MeshDistance gable = compare_meshes(floor, roof, options);
    EXPECT_LE(gable.forward.largest_mm, std::sqrt(0.5) + 1e-12);
    EXPECT_GE(gable.forward.largest_mm, std::sqrt(0.5) - options.tolerance_mm);
    EXPECT_DOUBLE_EQ(gable.backward.largest_mm, 1.0);

    // Asked to stop, it looks no further than the centres of triangles, 2/3 mm from the eaves.
    std::stop_source stop;
    stop.request_stop();
    const MeshDistance stopped =
        compare_meshes(floor, roof, {.tolerance_mm = 1e-4, .samples = 1, .stop = stop.get_token()});
    EXPECT_LT(stopped.forward.largest_mm, 0.6);
}

TEST(CompareMeshes, OfShiftedBallsIsTheShift) {
    // The farthest point of two equal spheres d apart is d away: by the triangle inequality no
    // farther, and at the pole in the direction of the shift exactly so.
    const Mesh ball = meshes::ball(10.0, 4);
    for (const glm::dvec3 shift : {glm::dvec3(0.5, 0, 0), glm::dvec3(0, 0, 3)}) {
        const DistanceOptions options{.tolerance_mm = 1e-3, .samples = 20000};
        const MeshDistance found = compare_meshes(ball, shifted(ball, shift), options);
        EXPECT_LE(found.hausdorff_mm(), glm::length(shift) + 1e-9);
        EXPECT_GE(found.hausdorff_mm(), glm::length(shift) - options.tolerance_mm);
        // Mirror images of each other, sampled at other points: equal up to the sampling.
        EXPECT_NEAR(found.forward.mean_mm, found.backward.mean_mm, 0.01 * glm::length(shift));
    }
    // Concentric spheres: every point of the inner one is 1 mm away, less the sag of facets.
    const MeshDistance shells = compare_meshes(meshes::ball(9.0, 5), meshes::ball(10.0, 5));
    const double sag = 10.0 * (1.0 - std::cos(0.5 * std::numbers::pi / 2 / 32));
    EXPECT_NEAR(shells.forward.mean_mm, 1.0, 2 * sag);
    EXPECT_NEAR(shells.forward.rms_mm, 1.0, 2 * sag);
    EXPECT_NEAR(shells.hausdorff_mm(), 1.0, 2 * sag);
}

TEST(CompareMeshes, NormalAnglesAreThoseOfTiltedPlanes) {
    const Mesh plane{.positions = {{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, .triangles = {{0, 1, 2}}};
    Mesh tilted = plane;
    tilted.world_from_mesh = glm::rotate(glm::dmat4(1.0), glm::radians(10.0), glm::dvec3(1, 0, 0));
    const MeshDistance found = compare_meshes(plane, tilted, {.samples = 100});
    EXPECT_NEAR(found.forward.normal_max_deg, 10.0, 1e-9);
    EXPECT_NEAR(found.forward.normal_rms_deg, 10.0, 1e-9);
    const MeshDistance back = compare_meshes(plane, meshes::turned_over(plane), {.samples = 100});
    EXPECT_NEAR(back.forward.normal_max_deg, 180.0, 1e-9);
}

TEST(CompareMeshes, NothingIsInfinitelyFar) {
    const Mesh ball = meshes::ball(1.0, 1);
    const MeshDistance found = compare_meshes(ball, Mesh{});
    EXPECT_TRUE(std::isinf(found.forward.largest_mm));
    EXPECT_EQ(found.backward.largest_mm, 0.0);
    EXPECT_EQ(compare_meshes(Mesh{}, Mesh{}).hausdorff_mm(), 0.0);
}

TEST(DistanceToField, OfABallIsTheSagOfItsFacets) {
    const glm::dvec3 center(3, -2, 5);
    const double radius = 10.0;
    Mesh ball = meshes::ball(radius, 4, center);
    ball.normals = vertex_normals(ball);
    const FieldDistance found =
        distance_to_field(ball, synthetic::sphere_distance(center, radius), 0.0);
    EXPECT_EQ(found.lost, 0u);
    // Vertices are floats below 16: off by half of 2^-20 on each axis.
    EXPECT_LE(found.vertex_largest_mm, std::sqrt(3.0) * 0x1p-21 + 1e-12);
    // Each edge of the octahedron, a quarter turn, is cut 16 times by equal shares of the chord at
    // first: no part is longer than 1.25 / 10 of a radian; a facet sags by at most R (1 - cos) of
    // the angle to its centre, which is below an edge / sqrt(3).
    EXPECT_LE(found.surface.largest_mm, radius * (1.0 - std::cos(0.16 / std::sqrt(3.0))));
    EXPECT_GT(found.surface.largest_mm, found.vertex_largest_mm);
    EXPECT_LE(found.surface.normal_max_deg, glm::degrees(0.16));
    EXPECT_LE(found.vertex_normal_max_deg, glm::degrees(0.05));
    EXPECT_GE(found.surface.rms_mm, found.surface.mean_mm);
}

// The Gaussian is no distance: its level sets are spheres all the same, and the answer too.
TEST(DistanceToField, NeedsNoDistanceField) {
    const double sigma = 6.0, radius = 7.0, off = 0.8;
    const synthetic::Field field = synthetic::gaussian({}, sigma);
    const double iso = field.value({radius, 0, 0});
    const Mesh ball = meshes::ball(radius + off, 3);
    const FieldDistance found = distance_to_field(ball, field, iso, {.samples = 2000});
    EXPECT_EQ(found.lost, 0u);
    EXPECT_NEAR(found.vertex_largest_mm, off, 1e-6);
    EXPECT_NEAR(found.vertex_rms_mm, off, 1e-6);
    // An ellipsoid's level set, by scaling the world under a sphere of constant value: the nearest
    // point is not along the gradient. Reference: a search over the surface.
    const glm::dvec3 axes(1.0, 1.0, 2.0);
    const synthetic::Field ellipsoid{
        [&](glm::dvec3 p) { return 25.0 - glm::dot(p / axes, p / axes); },
        [&](glm::dvec3 p) { return -2.0 * p / axes / axes; }};
    const glm::dvec3 start(4.0, 1.0, 8.0);
    const Mesh point{.positions = {glm::vec3(4, 1, 8), glm::vec3(4, 1, 8), glm::vec3(4.001, 1, 8)},
                     .triangles = {{0, 1, 2}}};
    double best = 1e9;
    const int cuts = 2000;
    for (int i = 0; i <= cuts; ++i)
        for (int j = 0; j < cuts / 5; ++j) {
            const double u = std::numbers::pi * i / cuts, v = std::numbers::pi * j / cuts;
            const glm::dvec3 p(5 * std::sin(u) * std::cos(v), 5 * std::sin(u) * std::sin(v),
                               10 * std::cos(u));
            best = std::min(best, std::min(glm::length(p - start),
                                           glm::length(p - start - glm::dvec3(1e-3, 0, 0))));
        }
    const FieldDistance far = distance_to_field(point, ellipsoid, 0.0, {.samples = 1});
    EXPECT_NEAR(far.vertex_largest_mm, best, 2e-3); // two starting points 1e-3 apart, one grid
}

} // namespace
} // namespace palpate
