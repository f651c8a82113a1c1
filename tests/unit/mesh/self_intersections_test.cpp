#include "engine/mesh/self_intersections.h"

#include <gmock/gmock.h>

#include <random>

namespace palpate {
namespace {

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;

Mesh two(std::array<glm::vec3, 3> a, std::array<glm::vec3, 3> b) {
    Mesh mesh;
    mesh.positions = {a[0], a[1], a[2], b[0], b[1], b[2]};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    return mesh;
}
const std::array<glm::vec3, 3> kFlat{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};

TEST(SelfIntersections, TellsTrianglesThatCutFromThoseThatDoNot) {
    const auto cut = [](std::array<glm::vec3, 3> other) {
        return !self_intersections(two(kFlat, other)).empty();
    };
    EXPECT_TRUE(cut({{{1, 1, -1}, {1, 1, 1}, {9, 9, 0}}}));   // an edge through the face
    EXPECT_TRUE(cut({{{1, -5, -1}, {1, 9, -1}, {1, 2, 9}}})); // its edges through the other's face
    EXPECT_TRUE(cut({{{1, 1, 0}, {1, 1, 1}, {2, 2, 1}}}));    // touches with a vertex
    EXPECT_FALSE(cut({{{1, 1, 1e-6f}, {1, 1, 1}, {2, 2, 1}}}));
    EXPECT_FALSE(cut({{{3, 3, -1}, {3, 3, 1}, {5, 5, 0}}})); // beside, boxes overlap
    EXPECT_TRUE(cut({{{1, 1, 0}, {9, 1, 0}, {1, 9, 0}}}));   // in one plane
    EXPECT_TRUE(cut({{{-9, -9, 0}, {29, -9, 0}, {-9, 29, 0}}}));
    EXPECT_FALSE(cut({{{2.5f, 2.5f, 0}, {4, 4, 0}, {2, 4, 0}}}));
}

TEST(SelfIntersections, NeighboursHaveTheirVerticesAndEdgesInCommon) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4, 0}, {-4, -4, 0}, {1, 1, 1}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}}; // an edge, flat
    EXPECT_THAT(self_intersections(mesh), testing::IsEmpty());
    mesh.triangles = {{0, 1, 2}, {0, 4, 5}}; // a vertex
    EXPECT_THAT(self_intersections(mesh), testing::IsEmpty());
    mesh.positions[4] = {1, 1, -1}; // and through the face
    EXPECT_EQ(self_intersections(mesh), (Pairs{{0, 1}}));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}}; // an edge, folded over
    mesh.positions[3] = {3, 1, 0};
    EXPECT_EQ(self_intersections(mesh), (Pairs{{0, 1}}));
    mesh.triangles = {{0, 1, 2}, {1, 2, 0}}; // one triangle twice
    EXPECT_EQ(self_intersections(mesh), (Pairs{{0, 1}}));
    mesh.triangles = {{0, 1, 1}, {0, 1, 2}}; // no triangle
    EXPECT_THAT(self_intersections(mesh), testing::IsEmpty());
}

// Common points are sought by halving both triangles: what it finds must be listed.
bool have_near_points(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b,
                      int depth) {
    const auto center = [](const auto& t) { return (t[0] + t[1] + t[2]) / 3.0; };
    const auto radius = [&](const auto& t) {
        double r = 0.0;
        for (const glm::dvec3 p : t)
            r = std::max(r, glm::distance(p, center(t)));
        return r;
    };
    if (glm::distance(center(a), center(b)) > radius(a) + radius(b))
        return false;
    if (depth == 0)
        return true;
    const auto quarters = [](const auto& t) {
        const glm::dvec3 x = 0.5 * (t[0] + t[1]), y = 0.5 * (t[1] + t[2]), z = 0.5 * (t[2] + t[0]);
        return std::array<std::array<glm::dvec3, 3>, 4>{
            {{t[0], x, z}, {t[1], y, x}, {t[2], z, y}, {x, y, z}}};
    };
    for (const auto& p : quarters(a))
        for (const auto& q : quarters(b))
            if (have_near_points(p, q, depth - 1))
                return true;
    return false;
}

// 300 triangles without a common vertex: every pair against halving to 2^-24 of their size. What
// halving calls far apart must not be listed. What it calls near and is not listed must be apart by
// that little: of random pairs, none.
TEST(SelfIntersections, AgreesWithHalvingOnRandomTriangles) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> place(-3, 3), size(-1, 1);
    Mesh mesh;
    for (uint32_t i = 0; i < 300; ++i) {
        const glm::vec3 at(place(random), place(random), place(random));
        for (int k = 0; k < 3; ++k)
            mesh.positions.push_back(at + glm::vec3(size(random), size(random), size(random)));
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    Pairs expected;
    const auto corners = [&](uint32_t n) {
        std::array<glm::dvec3, 3> out;
        for (size_t k = 0; k < 3; ++k)
            out[k] = glm::dvec3(mesh.positions[3 * n + k]);
        return out;
    };
    for (uint32_t a = 0; a < 300; ++a)
        for (uint32_t b = a + 1; b < 300; ++b)
            if (have_near_points(corners(a), corners(b), 24))
                expected.emplace_back(a, b);
    EXPECT_GT(expected.size(), 100u);
    EXPECT_EQ(self_intersections(mesh), expected);
}

} // namespace
} // namespace palpate
