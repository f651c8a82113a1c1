#include "engine/mesh/decimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>

#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

std::vector<int64_t> euler_numbers(const MeshTopology& found) {
    std::vector<int64_t> numbers;
    for (const MeshComponent& component : found.components)
        numbers.push_back(component.euler_number);
    std::sort(numbers.begin(), numbers.end());
    return numbers;
}

// No fault that was not there, the same components, and the distance that is told, which bounds the
// true one from above and is measured to a hundredth of the error; here to half of that.
void expect_sound(const Mesh& mesh, const Decimated& decimated, double error_mm) {
    const MeshTopology before = topology(mesh), after = topology(decimated.mesh);
    EXPECT_LE(after.open_edges, before.open_edges);
    EXPECT_EQ(after.closed, before.closed);
    EXPECT_LE(after.non_manifold_edges, before.non_manifold_edges);
    EXPECT_LE(after.non_manifold_vertices, before.non_manifold_vertices);
    EXPECT_LE(after.misoriented_edges, before.misoriented_edges);
    EXPECT_LE(after.duplicate_triangles, before.duplicate_triangles);
    EXPECT_LE(after.zero_area_triangles, before.zero_area_triangles);
    EXPECT_EQ(after.degenerate_triangles, 0u);
    EXPECT_EQ(euler_numbers(after), euler_numbers(before));
    EXPECT_LE(decimated.hausdorff_mm, error_mm);
    const MeshDistance distance =
        compare_meshes(mesh, decimated.mesh, {.tolerance_mm = 5e-3 * error_mm, .samples = 1000});
    EXPECT_LE(distance.hausdorff_mm(), decimated.hausdorff_mm);
    EXPECT_GE(distance.hausdorff_mm(), decimated.hausdorff_mm - 0.02 * error_mm);
}

Decimated decimate_or_fail(const Mesh& mesh, const DecimateOptions& options) {
    Result<Decimated> result = decimate(mesh, options);
    EXPECT_TRUE(result) << (result ? "" : result.error().message);
    return result ? std::move(*result) : Decimated{};
}

TEST(Decimate, KeepsToTheErrorAskedFor) {
    for (const Mesh& mesh : {meshes::ball(10.0, 3), meshes::torus(48, 24, 10.0, 4.0)})
        for (const double error_mm : {0.1, 0.5}) {
            const Result<Decimated> decimated = decimate(mesh, {.error_mm = error_mm});
            ASSERT_TRUE(decimated);
            expect_sound(mesh, *decimated, error_mm);
            // A facet of edge e sags by at most e^2 / 6r, r the smallest radius of the surface (4),
            // so facets of e^2 = 24 error would do; their number is area / (0.43 e^2), and
            // collapsing one by one gets within a few times of it.
            const double area = topology(mesh).area_mm2;
            EXPECT_LT(double(decimated->mesh.triangles.size()), 5.0 * area / (10.3 * error_mm))
                << error_mm;
        }
}

TEST(Decimate, MeasuresInTheWorld) {
    Mesh mesh = meshes::ball(10.0, 4);
    mesh.normals = vertex_normals(mesh);
    const Result<Decimated> near = decimate(mesh, {.error_mm = 0.1});
    mesh.world_from_mesh =
        glm::scale(glm::translate(glm::dmat4(1.0), glm::dvec3(1e6, 0, -1e6)), glm::dvec3(-4.0));
    const Result<Decimated> far = decimate(mesh, {.error_mm = 0.4});
    ASSERT_TRUE(near && far);
    // Distances are rounded a thousand kilometres away, and the next attempt with them.
    EXPECT_NEAR(double(near->mesh.triangles.size()), double(far->mesh.triangles.size()), 10.0);
    EXPECT_NEAR(far->hausdorff_mm, 4.0 * near->hausdorff_mm, 0.02);
    // Vertices move, and take the original's normal there; facets of a ball sag by 0.1 at most.
    for (size_t v = 0; v < near->mesh.positions.size(); ++v) {
        ASSERT_NEAR(glm::length(near->mesh.normals[v]), 1.0f, 1e-5f);
        ASSERT_GT(glm::dot(near->mesh.normals[v], near->mesh.positions[v]), 9.8f);
    }
}

TEST(Decimate, EndsAtTheCountAskedFor) {
    const Mesh mesh = meshes::ball(10.0, 3);
    const size_t quarter = mesh.triangles.size() / 4;
    const Decimated alone = decimate_or_fail(mesh, {.least_triangles = quarter});
    EXPECT_EQ(alone.mesh.triangles.size(), quarter); // each collapse takes two
    expect_sound(mesh, alone, alone.hausdorff_mm);
    // n equal facets of edge e in a ball sag by e^2 / 6r = 4 pi r / (1.5 sqrt(3) n); not all of
    // these are equal.
    EXPECT_LT(alone.hausdorff_mm, 2.0 * 4.0 * std::numbers::pi * 10.0 / (2.6 * double(quarter)));
    const Decimated both = decimate_or_fail(mesh, {.error_mm = 5.0, .least_triangles = quarter});
    EXPECT_EQ(both.mesh.triangles.size(), quarter);
    const Decimated held = decimate_or_fail(mesh, {.error_mm = 1e-3, .least_triangles = quarter});
    EXPECT_GT(held.mesh.triangles.size(), quarter);
    EXPECT_GT(held.kept.by_distance, 0u);
}

// A speck smaller than the error can neither go nor hold up the rest.
TEST(Decimate, SpecksOfNoiseStayAndTheRestIsDecimated) {
    const Mesh ball = meshes::ball(10.0, 4);
    Mesh mesh = meshes::beside(ball, meshes::ball(0.01, 1, {20, 0, 0}));
    const Decimated one = decimate_or_fail(mesh, {.error_mm = 0.5});
    expect_sound(mesh, one, 0.5);
    EXPECT_LT(one.mesh.triangles.size(), ball.triangles.size() / 8);
    EXPECT_EQ(topology(one.mesh).components[1].triangles, 4u); // the fewest that are closed
    std::mt19937 random(20);
    std::uniform_real_distribution<double> at(15.0, 60.0), radius(0.01, 0.6);
    for (int i = 0; i < 50; ++i)
        mesh = meshes::beside(
            mesh, meshes::ball(radius(random), i % 3, {at(random), at(random), at(random)}));
    mesh = meshes::beside(mesh, meshes::torus(32, 16, 10.0, 4.0));
    const Decimated many = decimate_or_fail(mesh, {.error_mm = 0.5});
    expect_sound(mesh, many, 0.5);
    EXPECT_LT(many.mesh.triangles.size(), mesh.triangles.size() / 5);
}

// A surface that ends in a plane, as at a volume's border, ends in that plane after it.
TEST(Decimate, OpenSurfacesKeepTheirBorders) {
    Mesh mesh = meshes::ball(10.0, 5);
    std::erase_if(mesh.triangles, [&](glm::uvec3 t) {
        return mesh.positions[t.x].z + mesh.positions[t.y].z + mesh.positions[t.z].z < 0.0f;
    });
    for (const double error_mm : {0.05, 0.5}) {
        const Decimated half = decimate_or_fail(mesh, {.error_mm = error_mm});
        expect_sound(mesh, half, error_mm);
        EXPECT_LT(half.mesh.triangles.size(), mesh.triangles.size() / 4);
        EXPECT_LT(topology(half.mesh).open_edges, topology(mesh).open_edges);
        std::map<std::pair<uint32_t, uint32_t>, int> uses;
        for (const glm::uvec3 t : half.mesh.triangles)
            for (int i = 0; i < 3; ++i)
                ++uses[std::minmax(t[i], t[(i + 1) % 3])];
        for (const auto& [edge, count] : uses)
            if (count == 1) {
                ASSERT_EQ(half.mesh.positions[edge.first].z, 0.0f);
            }
    }
}

TEST(Decimate, MoreErrorLeavesFewerTriangles) {
    const Mesh mesh = meshes::torus(32, 16, 10.0, 4.0);
    size_t before = mesh.triangles.size() + 1;
    for (const double error_mm : {0.01, 0.05, 0.2, 1.0}) {
        const Decimated found = decimate_or_fail(mesh, {.error_mm = error_mm});
        expect_sound(mesh, found, error_mm);
        EXPECT_LT(found.mesh.triangles.size(), before) << error_mm;
        before = found.mesh.triangles.size();
    }
}

TEST(Decimate, GivesTheSameOnAnyNumberOfThreads) {
    const Mesh mesh = meshes::beside(meshes::ball(10.0, 3), meshes::torus(24, 12, 10.0, 4.0));
    const Decimated many = decimate_or_fail(mesh, {.error_mm = 0.2});
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Decimated alone = decimate_or_fail(mesh, {.error_mm = 0.2});
    EXPECT_EQ(alone.mesh.positions, many.mesh.positions);
    EXPECT_EQ(alone.mesh.triangles, many.mesh.triangles);
    EXPECT_EQ(alone.hausdorff_mm, many.hausdorff_mm);
}

// Triangles without area, drawn twice, or that name a vertex twice; fans that share one vertex or
// one edge; one wound the wrong way.
TEST(Decimate, TakesAnyTriangles) {
    Mesh mesh = meshes::beside(meshes::ball(5.0, 3), meshes::ball(5.0, 3, {20, 0, 0}));
    mesh.triangles.push_back(mesh.triangles[0]);
    mesh.triangles.emplace_back(0, 100, 400);
    std::swap(mesh.triangles[60].x, mesh.triangles[60].y);
    const auto next = static_cast<uint32_t>(mesh.positions.size());
    for (int i = 0; i < 5; ++i)
        mesh.positions.emplace_back(40.0f + float(i), 0.0f, 0.0f);
    mesh.triangles.emplace_back(next, next + 1, next + 2);
    mesh.triangles.emplace_back(next + 1, next + 3, next + 2);
    mesh.triangles.emplace_back(next + 4, next, 0);
    Mesh with_a_line = mesh; // which is dropped
    with_a_line.triangles.emplace_back(1, 1, 2);
    const Decimated found = decimate_or_fail(with_a_line, {.error_mm = 0.5});
    expect_sound(mesh, found, 0.5);
    EXPECT_LT(found.mesh.triangles.size(), mesh.triangles.size() / 2);
}

TEST(Decimate, RefusesPositionsThatAreNotFinite) {
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), HUGE_VALF}) {
        Mesh mesh = meshes::ball(1.0, 1);
        mesh.positions[3].y = bad;
        const Result<Decimated> refused = decimate(mesh, {.error_mm = 0.1});
        ASSERT_FALSE(refused);
        EXPECT_THAT(refused.error().message, testing::HasSubstr("at vertex 3"));
    }
}

TEST(Decimate, KeepsLabelsAndTheWallsBetweenThem) {
    // A ball cut by the plane z = 0, where its vertices lie: label 1 above, 2 below, and a wall.
    Mesh mesh = meshes::ball(10.0, 4);
    for (const glm::uvec3 t : mesh.triangles) {
        float z = 0.0f;
        for (int i = 0; i < 3; ++i)
            z += mesh.positions[t[i]].z;
        mesh.labels.push_back(z > 0.0f ? 1 : 2);
        mesh.outer_labels.push_back(0);
    }
    const auto center = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.emplace_back(0.0f);
    const std::vector<glm::uvec3> shell = mesh.triangles;
    for (const glm::uvec3 t : shell)
        for (int i = 0; i < 3; ++i) {
            const uint32_t a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
            if (mesh.positions[a].z == 0.0f && mesh.positions[b].z == 0.0f &&
                mesh.positions[c].z > 0.0f) {
                mesh.triangles.emplace_back(a, b, center); // seen from above
                mesh.labels.push_back(2);
                mesh.outer_labels.push_back(1);
            }
        }
    const auto check = [&](const Mesh& m) {
        double sum = 0.0;
        for (const uint16_t label : {1, 2}) {
            const MeshTopology found = topology(surface_of_label(m, label));
            EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented) << label;
            EXPECT_EQ(found.euler_number, 2);
            sum += found.volume_mm3;
        }
        return sum;
    };
    const double before = check(mesh);
    const Result<Decimated> decimated = decimate(mesh, {.error_mm = 0.2});
    ASSERT_TRUE(decimated);
    EXPECT_LT(decimated->mesh.triangles.size(), mesh.triangles.size() / 3);
    EXPECT_LE(decimated->hausdorff_mm, 0.2);
    const double after = check(decimated->mesh);
    EXPECT_LT(std::abs(after - before), 0.2 * 4.0 * std::numbers::pi * 100.0);
}

TEST(Decimate, EndsWhenAskedToAndTakesNothing) {
    std::stop_source stop;
    stop.request_stop();
    const Result<Decimated> stopped =
        decimate(meshes::ball(1.0, 2), {.error_mm = 0.1, .stop = stop.get_token()});
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().message, "decimation was stopped");
    const Result<Decimated> nothing = decimate(Mesh{}, {.error_mm = 1.0});
    ASSERT_TRUE(nothing);
    EXPECT_TRUE(nothing->mesh.triangles.empty());
}

TEST(Decimate, RefusesAnErrorOfNothingAndFaultyMeshes) {
    const auto none = decimate(meshes::tetrahedron(), {.error_mm = 0.0});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "decimation: expected an error above 0 mm, found 0");
    Mesh faulty = meshes::tetrahedron();
    faulty.triangles[0].x = 9;
    EXPECT_FALSE(decimate(faulty, {}));
}

} // namespace
} // namespace palpate
