#include "engine/surface/shell.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/mesh/pieces.h"
#include "engine/mesh/topology.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

constexpr double kBall_mm = 20.0;
const glm::dvec3 kBallAt_mm(3.0, -40.0, 1000.0);

// A ball of the radius given as triangles; its sides lie within 3 s^2 / (8 r) of it, s the spacing.
Mesh ball(double radius_mm = kBall_mm, glm::dmat4 turned = glm::dmat4(1), double spacing = 1.0) {
    const auto samples = static_cast<uint32_t>(2.0 * radius_mm / spacing) + 8;
    Grid grid = make_grid(glm::uvec3(samples), glm::dvec3(spacing),
                          kBallAt_mm - 0.5 * spacing * (samples - 1.0));
    const auto depth = [&](glm::uvec3 i) {
        return radius_mm - glm::distance(world_point(grid, glm::dvec3(i)), kBallAt_mm);
    };
    const Volume volume = make_volume(grid, ScalarType::f32, depth);
    Mesh mesh = marching_cubes(volume, 0.0f, {});
    mesh.world_from_mesh = turned * mesh.world_from_mesh;
    return mesh;
}
double ball_mm3(double radius_mm) {
    return 4.0 / 3.0 * std::numbers::pi * radius_mm * radius_mm * radius_mm;
}
double flat_mm(double radius_mm) {
    return 3.0 / (8.0 * radius_mm);
}

TEST(Shell, OfABallIsWhatIsBetweenTwoBalls) {
    for (const bool mirrored : {false, true}) {
        const glm::dmat4 turned =
            mirrored ? glm::dmat4(glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, 1)) : glm::dmat4(1);
        const Mesh outer = ball(kBall_mm, turned);
        const Result<Shell> shell = hollowed(outer, {.wall_mm = 3.0});
        ASSERT_TRUE(shell) << shell.error().message;
        EXPECT_TRUE(shell->is_hollow);
        EXPECT_LT(shell->excess_mm, 0.06 * 3.0);
        const MeshTopology found = topology(shell->mesh);
        EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
        EXPECT_EQ(found.components.size(), 2u);
        EXPECT_EQ(found.euler_number, 4);
        const double inner_mm = kBall_mm - 3.0 - shell->excess_mm;
        // Both surfaces lie within a triangle's height of the balls; the hollow's grid is finer.
        const double most = 4.0 * std::numbers::pi *
                            (kBall_mm * kBall_mm * flat_mm(kBall_mm) +
                             inner_mm * inner_mm * (flat_mm(kBall_mm) + flat_mm(inner_mm)));
        EXPECT_NEAR(found.volume_mm3, ball_mm3(kBall_mm) - ball_mm3(inner_mm), most);
        for (size_t v = outer.positions.size(); v < shell->mesh.positions.size(); ++v) {
            const glm::dvec3 at(
                turned * shell->mesh.world_from_mesh *
                glm::dvec4(shell->mesh.positions[v], 1.0)); // a mirror undoes itself
            const double thick = kBall_mm - glm::distance(at, kBallAt_mm);
            ASSERT_GE(thick, 3.0 - 1e-4);
            ASSERT_LE(thick, 3.0 + shell->excess_mm + 2.0 * flat_mm(kBall_mm));
        }
    }
}

// A box is bounded by planes, so that the inner box is known but for its edges, which lie in one
// cell of the grid.
TEST(Shell, OfABoxHasFlatWallsOfTheThickness) {
    const glm::uvec3 size(30, 20, 12);
    const Volume voxels = make_volume(
        make_grid(size + 4u, {1, 1, 1}, {-50, 0, 7}), ScalarType::u8, [&](glm::uvec3 i) {
            return glm::all(glm::greaterThanEqual(i, glm::uvec3(2))) &&
                           glm::all(glm::lessThan(i, size + 2u))
                       ? 1.0
                       : 0.0;
        });
    const Result<Shell> shell = hollowed(surface_nets(voxels), {.wall_mm = 2.0});
    ASSERT_TRUE(shell) << shell.error().message;
    const double wall = 2.0 + shell->excess_mm, cell = shell->cell_mm;
    const glm::dvec3 inner = glm::dvec3(size) - 2.0 * wall;
    const double all = double(size.x) * size.y * size.z, hollow = inner.x * inner.y * inner.z;
    const double found = all - topology(shell->mesh).volume_mm3;
    EXPECT_LE(found, hollow * (1.0 + 1e-5));
    EXPECT_GE(found, hollow - 4.0 * (inner.x + inner.y + inner.z) * cell * cell);
    EXPECT_EQ(shell->mesh.labels.size(), shell->mesh.triangles.size());
}

TEST(Shell, OfABodyWithAHollowHasAWallAboutIt) {
    // A ball of 20 mm about one of 8 mm that is no part of it: walls of 2 mm leave a hollow between
    // 10 and 18 mm.
    Mesh body = ball();
    const Mesh hole = ball(8.0);
    const glm::dmat4 to_body = glm::inverse(body.world_from_mesh) * hole.world_from_mesh;
    const auto offset = static_cast<uint32_t>(body.positions.size());
    body.normals.clear();
    for (const glm::vec3 p : hole.positions)
        body.positions.emplace_back(to_body * glm::dvec4(p, 1.0));
    for (const glm::uvec3 t : hole.triangles)
        body.triangles.push_back(offset + glm::uvec3(t.y, t.x, t.z));
    const Result<Shell> shell = hollowed(body, {.wall_mm = 2.0});
    ASSERT_TRUE(shell) << shell.error().message;
    const MeshTopology found = topology(shell->mesh);
    EXPECT_EQ(found.components.size(), 4u);
    EXPECT_TRUE(found.closed && found.consistently_oriented);
    const double wall = 2.0 + shell->excess_mm;
    const double expected =
        ball_mm3(20.0) - ball_mm3(20.0 - wall) + ball_mm3(8.0 + wall) - ball_mm3(8.0);
    double most =
        0.0; // each of four surfaces by the height of its triangles and of those it is from
    for (const double r : {20.0, 20.0 - wall, 8.0, 8.0 + wall})
        most += 4.0 * std::numbers::pi * r * r * (flat_mm(r) + flat_mm(8.0));
    EXPECT_NEAR(found.volume_mm3, expected, most);

    const Pieces all = keep_pieces(shell->mesh, {}),
                 one = keep_pieces(shell->mesh, {.largest_only = true}),
                 large = keep_pieces(shell->mesh,
                                     {.least_mm3 = 0.5 * (ball_mm3(8.0) + ball_mm3(8.0 + wall))});
    EXPECT_EQ(all.kept, 4u);
    EXPECT_EQ(all.mesh.positions, shell->mesh.positions);
    EXPECT_EQ(all.mesh.triangles, shell->mesh.triangles);
    EXPECT_EQ(one.kept, 1u);
    EXPECT_EQ(one.dropped, 3u);
    EXPECT_NEAR(topology(one.mesh).volume_mm3, ball_mm3(20.0), 0.01 * ball_mm3(20.0));
    EXPECT_EQ(large.kept, 3u) << "the ball of 8 mm goes";
    EXPECT_TRUE(topology(large.mesh).closed);
}

TEST(Shell, OfAThinBodyIsTheBodyAndAnOpenOneIsRefused) {
    const Mesh thin = ball(4.0);
    const Result<Shell> solid = hollowed(thin, {.wall_mm = 5.0});
    ASSERT_TRUE(solid) << solid.error().message;
    EXPECT_FALSE(solid->is_hollow);
    EXPECT_EQ(solid->mesh.triangles, thin.triangles);

    Mesh open = ball(6.0);
    open.triangles.pop_back();
    EXPECT_FALSE(hollowed(open, {.wall_mm = 1.0}));
    EXPECT_FALSE(hollowed(ball(), {.wall_mm = 0.0}));
    const Result<Shell> fine = hollowed(ball(), {.wall_mm = 0.1, .max_samples = 1 << 15});
    ASSERT_FALSE(fine);
    EXPECT_NE(fine.error().message.find("too thin"), std::string::npos) << fine.error().message;
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(hollowed(ball(), {.wall_mm = 2.0, .stop = stop.get_token()}));
}

} // namespace
} // namespace palpate
