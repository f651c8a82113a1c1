#include "engine/edit/shape.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

using Random = std::mt19937_64;

glm::dvec3 any_point(Random& random, double reach) {
    std::uniform_real_distribution<double> u(-reach, reach);
    return {u(random), u(random), u(random)};
}

struct Case {
    const char* name;
    ShapePtr shape;
    bool (*inside)(glm::dvec3 p); // by its definition
    bool exact;
};

// A right-handed quarter turn about z, and a third of a turn about the diagonal.
const glm::dquat kQuarter(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
const glm::dquat kThird(0.5, 0.5, 0.5, 0.5);

std::vector<Case> cases() {
    return {
        {"ball", make_ball(3.0), [](glm::dvec3 p) { return glm::dot(p, p) <= 9.0; }, true},
        {"ellipsoid", make_ellipsoid({1, 2, 5}),
         [](glm::dvec3 p) { return p.x * p.x + p.y * p.y / 4 + p.z * p.z / 25 <= 1.0; }, false},
        {"capsule", make_capsule(1.5, 4.0),
         [](glm::dvec3 p) {
             const double z = p.z < 0 ? p.z : p.z > 4 ? p.z - 4 : 0.0;
             return p.x * p.x + p.y * p.y + z * z <= 2.25;
         },
         true},
        {"cylinder", make_cylinder(2.0, 3.0),
         [](glm::dvec3 p) { return p.x * p.x + p.y * p.y <= 4.0 && p.z >= 0 && p.z <= 3; }, true},
        {"box", make_box({2, 4, 6}),
         [](glm::dvec3 p) {
             return std::abs(p.x) <= 1 && std::abs(p.y) <= 2 && std::abs(p.z) <= 3;
         },
         true},
        {"burr", make_burr(3.0, 5, 0.8),
         [](glm::dvec3 p) {
             if (glm::length(p) > 3.0)
                 return false;
             double nearest = 1e9; // to points along each meridian: truth to 0.2 %
             for (int flute = 0; flute < 5; ++flute)
                 for (int i = 0; i <= 400; ++i) {
                     const double a = 2 * M_PI * flute / 5, b = M_PI * i / 400;
                     const glm::dvec3 q = 3.0 * glm::dvec3(std::cos(a) * std::sin(b),
                                                           std::sin(a) * std::sin(b), std::cos(b));
                     nearest = std::min(nearest, glm::length(p - q));
                 }
             return nearest >= 0.8;
         },
         false},
        {"union",
         make_union({make_ball(2.0), make_placed(make_ball(1.0), {2.5, 0, 0}, {1, 0, 0, 0}, 1.0)}),
         [](glm::dvec3 p) {
             return glm::length(p) <= 2.0 || glm::length(p - glm::dvec3(2.5, 0, 0)) <= 1.0;
         },
         true},
        {"difference", make_difference({make_ball(3.0), make_box({2, 2, 20})}),
         [](glm::dvec3 p) {
             return glm::length(p) <= 3.0 && !(std::abs(p.x) < 1 && std::abs(p.y) < 1);
         },
         false},
        {"intersection", make_intersection({make_ball(3.0), make_box({4, 4, 4})}),
         [](glm::dvec3 p) {
             return glm::length(p) <= 3.0 &&
                    std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= 2;
         },
         false},
        {"placed", make_placed(make_cylinder(1.0, 2.0), {1, 2, 3}, kThird, 1.5),
         [](glm::dvec3 p) { // a third of a turn takes z to x
             const glm::dvec3 q = (p - glm::dvec3(1, 2, 3)) / 1.5;
             return q.x >= 0 && q.x <= 2 && q.y * q.y + q.z * q.z <= 1.0;
         },
         true},
    };
}

TEST(Shape, SignIsThatOfTheDefinition) {
    Random random(1);
    for (const Case& c : cases()) {
        int inside = 0;
        for (int i = 0; i < 4000; ++i) {
            const glm::dvec3 p = any_point(random, 5.0);
            const double value = c.shape->signed_mm(p);
            if (std::abs(value) < 0.005) // points along meridians are 3 mm * pi / 800 off
                continue;
            inside += value < 0.0;
            ASSERT_EQ(value < 0.0, c.inside(p)) << c.name << " " << p.x << " " << p.y << " " << p.z;
        }
        EXPECT_GT(inside, 20) << c.name;
    }
}

// Rows and sweeps rely on this. Rounding: a few units in the last place of 10.
TEST(Shape, NoFunctionIsSteeperThanOne) {
    Random random(2);
    for (const Case& c : cases())
        for (int i = 0; i < 4000; ++i) {
            const glm::dvec3 p = any_point(random, 6.0),
                             q = p + any_point(random, i % 2 ? 0.1 : 5.0);
            ASSERT_LE(std::abs(c.shape->signed_mm(p) - c.shape->signed_mm(q)),
                      glm::length(p - q) + 1e-13)
                << c.name;
        }
}

TEST(Shape, BoundsHoldEveryPointInside) {
    Random random(3);
    for (const Case& c : cases())
        for (int i = 0; i < 4000; ++i) {
            const glm::dvec3 p = any_point(random, 6.0);
            if (c.shape->signed_mm(p) <= 0.0) {
                ASSERT_LE(c.shape->bounds().signed_mm(p), 1e-12) << c.name;
            }
        }
}

// Outside an exact shape, the value is reached: going that far against the gradient meets it.
TEST(Shape, ExactOnesTellTheDistance) {
    Random random(4);
    const double h = 1e-5;
    for (const Case& c : cases())
        for (int i = 0; i < 500 && c.exact; ++i) {
            const glm::dvec3 p = any_point(random, 6.0);
            const double value = c.shape->signed_mm(p);
            if (value <= 0.01)
                continue;
            glm::dvec3 gradient;
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 d(0.0);
                d[axis] = h;
                gradient[axis] = (c.shape->signed_mm(p + d) - c.shape->signed_mm(p - d)) / (2 * h);
            }
            if (std::abs(glm::length(gradient) - 1.0) > 1e-3)
                continue; // on the medial axis of a union
            const glm::dvec3 foot = p - value * gradient / glm::length(gradient);
            // Differences of second order: h^2 / distance to the next kink, and rounding / h.
            EXPECT_NEAR(c.shape->signed_mm(foot), 0.0, 1e-4) << c.name;
        }
}

Mesh sphere_mesh(double radius, uint32_t rings) { // a closed ball of quads, split
    Mesh mesh;
    const uint32_t around = 2 * rings;
    mesh.positions.push_back({0, 0, float(radius)});
    for (uint32_t r = 1; r < rings; ++r)
        for (uint32_t a = 0; a < around; ++a) {
            const double v = M_PI * r / rings, u = 2 * M_PI * a / around;
            mesh.positions.push_back(
                glm::vec3(radius * glm::dvec3(std::sin(v) * std::cos(u), std::sin(v) * std::sin(u),
                                              std::cos(v))));
        }
    mesh.positions.push_back({0, 0, float(-radius)});
    const auto at = [&](uint32_t r, uint32_t a) { return 1 + (r - 1) * around + a % around; };
    const auto last = static_cast<uint32_t>(mesh.positions.size() - 1);
    for (uint32_t a = 0; a < around; ++a) {
        mesh.triangles.push_back({0, at(1, a), at(1, a + 1)});
        mesh.triangles.push_back({last, at(rings - 1, a + 1), at(rings - 1, a)});
        for (uint32_t r = 1; r + 1 < rings; ++r) {
            mesh.triangles.push_back({at(r, a), at(r + 1, a), at(r + 1, a + 1)});
            mesh.triangles.push_back({at(r, a), at(r + 1, a + 1), at(r, a + 1)});
        }
    }
    return mesh;
}

TEST(MeshShape, WindingTellsInsideEvenOnEdgesAndVertices) {
    const Mesh mesh = sphere_mesh(4.0, 6);
    EXPECT_TRUE(is_closed(mesh));
    for (int z = -5; z <= 5; ++z) // many of these rays run through vertices and along edges
        for (int y = -5; y <= 5; ++y)
            for (int x = -5; x <= 5; ++x) {
                const glm::dvec3 p(x, y, z);
                const double r = glm::length(p);
                if (r > 4.0) {
                    EXPECT_EQ(winding_number(mesh, p), 0) << x << " " << y << " " << z;
                } else if (r < 4.0 * std::cos(M_PI / 12) * std::cos(M_PI / 12)) { // of chords
                    EXPECT_EQ(winding_number(mesh, p), 1) << x << " " << y << " " << z;
                }
            }
}

TEST(MeshShape, DistanceIsThatOfTheTriangles) {
    const Mesh mesh = sphere_mesh(4.0, 12);
    const double cell = 0.25;
    const Result<ShapePtr> shape = make_mesh_shape(mesh, cell);
    ASSERT_TRUE(shape) << shape.error().message;
    Random random(5);
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 p = any_point(random, 4.5);
        double distance = 1e9;
        for (const glm::uvec3 t : mesh.triangles)
            distance = std::min(distance, triangle_distance(p, glm::dvec3(mesh.positions[t.x]),
                                                            glm::dvec3(mesh.positions[t.y]),
                                                            glm::dvec3(mesh.positions[t.z])));
        if (winding_number(mesh, p) != 0)
            distance = -distance;
        const double value = (*shape)->signed_mm(p);
        // Interpolation of a 1-Lipschitz function errs by at most the mean distance to a cell's
        // corners, no more than half its diagonal.
        const double error = cell * std::sqrt(3.0) / 2.0;
        if (std::abs(distance) > error) {
            EXPECT_EQ(value < 0.0, distance < 0.0);
        }
        if (std::abs(distance) < 3.0 * cell - error && (*shape)->bounds().signed_mm(p) < 0.0) {
            EXPECT_NEAR(value * std::sqrt(3.0), distance, error);
        }
        const glm::dvec3 q = p + any_point(random, 0.2);
        // Samples are floats of up to 1 mm: 2^-25 of rounding at the eight corners.
        EXPECT_LE(std::abs((*shape)->signed_mm(q) - value), glm::length(p - q) + 1e-6);
    }
}

TEST(MeshShape, TriangleDistanceIsTheLeastOverItsPoints) {
    Random random(6);
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 a = any_point(random, 2), b = any_point(random, 2),
                         c = any_point(random, 2);
        const glm::dvec3 p = any_point(random, 3);
        double least = 1e9;
        const int n = 200;
        for (int u = 0; u <= n; ++u)
            for (int v = 0; u + v <= n; ++v)
                least = std::min(
                    least, glm::length(p - a - double(u) / n * (b - a) - double(v) / n * (c - a)));
        const double found = triangle_distance(p, a, b, c);
        EXPECT_LE(found, least + 1e-12);
        // The nearest of the grid of points lies within one step of the foot.
        EXPECT_GE(found, least - (glm::length(b - a) + glm::length(c - a)) / n);
    }
}

TEST(MeshShape, RefusesWhatEnclosesNothing) {
    Mesh open = sphere_mesh(2.0, 4);
    open.triangles.pop_back();
    EXPECT_THAT(make_mesh_shape(open, 0.5).error().message, testing::HasSubstr("closed mesh"));
    EXPECT_FALSE(make_mesh_shape(Mesh{}, 0.5));
    EXPECT_THAT(make_mesh_shape(sphere_mesh(100.0, 4), 0.01).error().message,
                testing::HasSubstr("cells of 0.01 mm"));
    Mesh wrong = sphere_mesh(2.0, 4);
    wrong.triangles[0].x = 10000;
    EXPECT_FALSE(make_mesh_shape(wrong, 0.5));
}

} // namespace
} // namespace palpate
