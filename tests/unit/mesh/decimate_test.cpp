#include "engine/mesh/decimate.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

void expect_sound(const Mesh& before, const Decimated& decimated, double error_mm) {
    const MeshTopology found = topology(decimated.mesh);
    EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    EXPECT_EQ(found.euler_number, topology(before).euler_number);
    EXPECT_LE(decimated.hausdorff_mm, error_mm);
    // Measured again: what is told holds 0.05 for what measuring may have missed, and this 0.02.
    const MeshDistance distance = compare_meshes(
        before, decimated.mesh, {.tolerance_mm = 0.02 * error_mm, .samples = 20'000});
    EXPECT_LE(distance.hausdorff_mm(), decimated.hausdorff_mm);
    EXPECT_GE(distance.hausdorff_mm(), decimated.hausdorff_mm - 0.071 * error_mm);
}

TEST(Decimate, KeepsToTheErrorAskedFor) {
    for (const Mesh& mesh : {meshes::ball(10.0, 4), meshes::torus(64, 32, 10.0, 4.0)})
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
    // Vertices are some of the original's, normals with them.
    for (size_t v = 0; v < near->mesh.positions.size(); ++v)
        ASSERT_GT(glm::dot(near->mesh.normals[v], near->mesh.positions[v]), 9.9f);
}

TEST(Decimate, StopsAtTheLeastShare) {
    const Mesh mesh = meshes::ball(10.0, 5);
    const Result<Decimated> decimated = decimate(mesh, {.error_mm = 5.0, .least_share = 0.25});
    ASSERT_TRUE(decimated);
    const double share = double(decimated->mesh.triangles.size()) / double(mesh.triangles.size());
    EXPECT_GE(share, 0.25);
    EXPECT_LT(share, 0.26);
    expect_sound(mesh, *decimated, 5.0);
}

TEST(Decimate, KeepsLabelsAndTheWallsBetweenThem) {
    // A ball cut by the plane z = 0, where its vertices lie: label 1 above, 2 below, and a wall.
    Mesh mesh = meshes::ball(10.0, 5);
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

} // namespace
} // namespace palpate
