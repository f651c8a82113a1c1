// Parts of the repaired algorithms that feel triangles: samples of a finer lattice, triangles that
// bulge, and places where a point rests on them.

#include <cmath>
#include <memory>
#include <random>

#include "haptics/field/fine_samples.h"
#include "haptics/proxy/rest.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;
using glm::ivec3;

// ---- samples of a finer lattice -----------------------------------------------------------------

// Both views are a Field's, without noise, with it and of labels, on both spacings, within the
// volume and about its border. Sums of floats: some 3 x 12 terms of up to 1.4^3 times the largest
// sample, each rounded by 2^-24, in either of the two.
TEST(FineSamples, AreAFieldsViewsAtThePointsOfTheLattice) {
    TouchCase body{.id = "A2", .name = "ball", .solid = ball({0, 0, 9.0}, 6.0)};
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm})
        for (const double noise : {0.0, 0.1})
            for (const Form form : {Form::grey_f32, Form::labels}) {
                body.noise = noise;
                const Storage storage{.spacing_mm = spacing, .form = form, .noise = noise};
                const Scene scene = make_scene(body, storage);
                haptics::TouchParameters parameters = scene_parameters(scene);
                const bool labels = form == Form::labels;
                const Volume& volume = labels ? *scene.touch.labels : *scene.touch.grey;
                parameters.source =
                    labels ? haptics::TouchSource::labels : haptics::TouchSource::grey;
                if (!labels)
                    tune(parameters, volume);
                const auto field = std::make_unique<haptics::Field>();
                field->follow(volume, parameters);
                const double base = labels ? 0.5 : parameters.iso; // what a Field adds
                const double tolerance = 2.0 * 36.0 * 2.75 * 0x1p-24 * (labels ? 1.0 : 2000.0);
                for (const int finer : {1, 2, 4}) {
                    haptics::FineSamples samples(finer);
                    samples.follow(volume, parameters);
                    EXPECT_NEAR(samples.threshold() + base, field->iso(), tolerance);
                    double least = INFINITY, most = -INFINITY;
                    for (const dvec3 about : {dvec3(0, 0, 3.0), dvec3(4, 1, 5), dvec3(0, 0, 15.9),
                                              dvec3(16, -16, 16)}) {
                        const ivec3 first =
                            ivec3(glm::round(double(finer) * index_point(volume.grid(), about))) -
                            4;
                        const float *sharp = samples.sharp(first, 9).values,
                                    *smooth = samples.smooth(first, 9).values;
                        for (int i = 0; i < 729; ++i) {
                            const ivec3 at = first + ivec3(i % 9, i / 9 % 9, i / 81);
                            const dvec3 mm = world_point(volume.grid(), dvec3(at) / double(finer));
                            const haptics::Field::Both there = field->both(mm);
                            ASSERT_NEAR(sharp[i] + base, there.sharp.value, tolerance);
                            ASSERT_NEAR(smooth[i] + base, there.smooth.value, tolerance);
                            least = std::min(least, there.sharp.value);
                            most = std::max(most, there.sharp.value);
                        }
                    }
                    EXPECT_LT(least, field->iso());
                    EXPECT_GT(most, field->iso());
                }
            }
}

TEST(FineSamples, HaveTheSameBitsInEveryBoxAndAreClearOnlyWhereAllIsFree) {
    for (const double noise : {0.0, 0.1}) {
        const Storage storage{.spacing_mm = kUneven_mm, .form = Form::grey_i16, .noise = noise};
        const Scene scene = make_scene(flat_plane(), storage);
        haptics::FineSamples samples(4);
        samples.follow(*scene.touch.grey, settings(scene));
        const ivec3 middle(4.0 * index_point(scene.touch.grey->grid(), {0, 0, 0.13}));
        int clear = 0, solid = 0;
        std::mt19937 random(5);
        for (int n = 0; n < 100; ++n) {
            const ivec3 first = middle + ivec3(random() % 40, random() % 40, random() % 160) - 80;
            const ivec3 shift(random() % 5, random() % 5, random() % 5);
            const float* values = samples.sharp(first, 13).values;
            const std::vector<float> sharp(values, values + 13 * 13 * 13);
            const bool is_clear = samples.is_clear(first, first + 12);
            clear += is_clear;
            for (const float value : sharp) {
                solid += value >= samples.threshold();
                ASSERT_FALSE(is_clear && value >= samples.threshold());
            }
            const float* other = samples.sharp(first + shift, 9).values;
            for (int i = 0; i < 729; ++i) {
                const ivec3 at = shift + ivec3(i % 9, i / 9 % 9, i / 81);
                ASSERT_EQ(other[i], sharp[size_t(at.x + 13 * (at.y + 13 * at.z))]);
            }
        }
        EXPECT_GT(solid, 1000);
        if (noise == 0.0) {
            EXPECT_GT(clear, 5);
        }
    }
}

// ---- triangles that bulge -----------------------------------------------------------------------

// A sphere about the origin: an octahedron divided, its normals exact but for floats.
struct Sphere {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::uvec3> triangles;
    double edge_mm = 0.0; // the longest

    Sphere(double radius, int divisions) {
        const auto add = [&](dvec3 p) {
            const dvec3 n = glm::normalize(p);
            normals.push_back(glm::vec3(n));
            positions.push_back(glm::vec3(radius * n));
            return static_cast<uint32_t>(positions.size() - 1);
        };
        for (int octant = 0; octant < 8; ++octant) {
            const dvec3 sign(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1);
            const auto at = [&](int i, int j) {
                return add(sign * dvec3(i, j, divisions - i - j));
            };
            const auto face = [&](uint32_t a, uint32_t b, uint32_t c) {
                if (sign.x * sign.y * sign.z < 0.0)
                    std::swap(b, c);
                triangles.push_back({a, b, c});
                for (const auto& [p, q] : {std::pair{a, b}, {b, c}, {c, a}})
                    edge_mm = std::max(edge_mm, double{glm::distance(positions[p], positions[q])});
            };
            for (int i = 0; i < divisions; ++i)
                for (int j = 0; i + j < divisions; ++j) {
                    face(at(i + 1, j), at(i, j + 1), at(i, j));
                    if (i + j + 1 < divisions)
                        face(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                }
        }
    }
    haptics::TriangleSpan span(double bulge_mm) const {
        return {positions, normals, triangles, bulge_mm};
    }
};

constexpr double kBallRadius_mm = 6.0;

// With e_i = 1 - cos of the angle to vertex i and their means E = sum w e, E2 = sum w e^2, a point
// of a facet lies at R (1 - E), and what it bulges to at R (1 - E) (1 + E - E2 / 2) along its own
// direction: R (E^2 + E2 / 2) too deep, at most 3/2 R e^2; and at most R e sqrt(2 e) aside, which
// is R e^3 further out. Of a facet with edges up to c, e <= c^2 / (2 R (R - c^2 / 2R)).
struct Bound {
    double e, depth_mm, aside_mm;
    explicit Bound(double edge_mm) {
        const double c2 = edge_mm * edge_mm;
        e = c2 / (2.0 * kBallRadius_mm * (kBallRadius_mm - c2 / (2.0 * kBallRadius_mm)));
        depth_mm = kBallRadius_mm * (1.5 * e * e + e * e * e) + 1e-6; // floats of 6 mm
        aside_mm = kBallRadius_mm * e * std::sqrt(2.0 * e) + 1e-6;
    }
};

TEST(CurvedTriangles, LieOnTheSphereThatTheirNormalsAreOf) {
    const Sphere sphere(kBallRadius_mm, 12);
    const Bound bound(sphere.edge_mm);
    double flat = 0.0, curved = 0.0;
    for (const glm::uvec3 t : sphere.triangles) {
        const std::array one{t};
        const haptics::TriangleSpan span{sphere.positions, sphere.normals, one, 1.0};
        for (int i = 0; i <= 4; ++i)
            for (int j = 0; i + j <= 4; ++j) {
                const dvec3 p = (double(i) * dvec3(sphere.positions[t.x]) +
                                 double(j) * dvec3(sphere.positions[t.y]) +
                                 double(4 - i - j) * dvec3(sphere.positions[t.z])) /
                                4.0;
                const haptics::SurfacePoint at = nearest_point(span, p);
                flat = std::max(flat, std::abs(glm::length(at.point) - kBallRadius_mm));
                curved = std::max(curved, std::abs(glm::length(at.curved) - kBallRadius_mm));
            }
    }
    EXPECT_LE(curved, bound.depth_mm);
    EXPECT_GE(flat, 20.0 * curved) << "facets are so much deeper";
}

TEST(CurvedTriangles, MeetAtTheirEdges) {
    // One triangle, and one over its edge with other normals at its third corner.
    const dvec3 a(0, 0, 0), b(1, 0, 0.2), c(0.4, 1, 0), d(0.5, -1, -0.3);
    const std::vector<glm::vec3> positions{glm::vec3(a), glm::vec3(b), glm::vec3(c), glm::vec3(d)};
    std::vector<glm::vec3> normals;
    for (const dvec3 n :
         {dvec3(-0.2, 0.1, 1), dvec3(0.3, 0.1, 1), dvec3(0, 0.4, 1), dvec3(0.1, -0.5, 1)})
        normals.push_back(glm::vec3(glm::normalize(n)));
    const std::array one{glm::uvec3(0, 1, 2)}, other{glm::uvec3(1, 0, 3)};
    for (const double most : {0.02, 1.0}) // with the bound met, and without
        for (int i = 0; i <= 10; ++i) {
            const dvec3 p = glm::mix(dvec3(positions[0]), dvec3(positions[1]), 0.1 * i);
            const haptics::SurfacePoint left = nearest_point(
                                            haptics::TriangleSpan{positions, normals, one, most},
                                            p),
                                        right = nearest_point(
                                            haptics::TriangleSpan{positions, normals, other, most},
                                            p);
            EXPECT_LE(glm::distance(left.curved, right.curved), 1e-12) << i;
            EXPECT_LE(glm::distance(left.curved, left.point), most + 1e-12) << i;
            if (i == 5) {
                EXPECT_GT(glm::distance(left.curved, left.point), 0.01);
            }
        }
}

// The goal lies straight under the place where a point settles on the sphere: normals of a facet's
// point are the sphere's own there, so that what is left is how far aside it bulges, and 1e-4 mm.
TEST(CurvedTriangles, HoldAPointStraightOverItsGoal) {
    const Sphere sphere(kBallRadius_mm, 24);
    const Bound bound(sphere.edge_mm);
    const haptics::TriangleSpan span = sphere.span(1.0);
    const dvec3 low(-20.0), high(20.0);
    std::mt19937_64 random(3);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
    int settled = 0;
    for (int n = 0; n < 400; ++n) {
        const dvec3 way = glm::normalize(dvec3(unit(), unit(), unit()) + 1e-3);
        const dvec3 goal = (kBallRadius_mm - 0.05 - 1.5 * (unit() + 0.5)) * way;
        // From where a hand comes from that slides by.
        const dvec3 from = 8.0 * glm::normalize(way + 0.3 * dvec3(unit(), unit(), unit()));
        haptics::Rest rest = come_to_rest(span, from, goal, low, high);
        ASSERT_TRUE(rest.touching);
        rest = settle(span, rest, goal, low, high, 0.5 * sphere.edge_mm);
        ASSERT_TRUE(rest.touching);
        settled += rest.settled;
        if (!rest.settled)
            continue;
        const double goal_mm = glm::length(goal), aside = bound.aside_mm + 1e-4;
        const dvec3 truth = kBallRadius_mm * way;
        EXPECT_LE(glm::distance(rest.curved, truth),
                  aside * (1.0 + kBallRadius_mm / goal_mm) + bound.depth_mm + haptics::kSkin_mm);
        // Never into a facet.
        EXPECT_GE(glm::dot(rest.point - nearest_point(span, rest.point).point, rest.point), 0.0);
    }
    EXPECT_GE(settled, 390);
}

// A goal just under the sphere and over its facets is held, and one just over it is not: no force
// starts or ends with a jump.
TEST(CurvedTriangles, HoldAsSoonAsTheBulgeIsMet) {
    const Sphere sphere(kBallRadius_mm, 24);
    const Bound bound(sphere.edge_mm);
    const haptics::TriangleSpan span = sphere.span(1.0);
    const glm::uvec3 t = sphere.triangles[40];
    const dvec3 way = glm::normalize(dvec3(sphere.positions[t.x]) + dvec3(sphere.positions[t.y]) +
                                     dvec3(sphere.positions[t.z]));
    const haptics::SurfacePoint facet = first_crossing(span, 8.0 * way, 4.0 * way);
    ASSERT_TRUE(facet.found);
    const double sag = kBallRadius_mm - glm::length(facet.point);
    ASSERT_GT(sag, 10.0 * bound.depth_mm);
    for (const double share : {0.2, 0.5, 0.8}) {
        const dvec3 goal = (kBallRadius_mm - share * sag) * way;
        const haptics::Rest held = rest_under_bulge(span, goal);
        EXPECT_TRUE(held.touching) << share;
        EXPECT_NEAR(glm::distance(held.curved, goal), share * sag,
                    2.0 * bound.depth_mm + haptics::kSkin_mm);
    }
    const haptics::Rest free =
        rest_under_bulge(span, (kBallRadius_mm + 2.0 * bound.depth_mm + 1e-4) * way);
    EXPECT_FALSE(free.touching);
    EXPECT_EQ(free.curved, free.point);
}

// A point as near to a face as floats round, or behind it by so much, is off it again.
TEST(CurvedTriangles, ArePutOffFromWhereWindowsDiffer) {
    const Sphere sphere(kBallRadius_mm, 12);
    const haptics::TriangleSpan span = sphere.span(0.0);
    for (const double above : {-5e-6, 0.0, 5e-6, 5e-5}) {
        const glm::uvec3 t = sphere.triangles[77];
        const dvec3 a(sphere.positions[t.x]), b(sphere.positions[t.y]), c(sphere.positions[t.z]);
        const dvec3 n = glm::normalize(glm::cross(b - a, c - a));
        const dvec3 put = off_the_faces(span, (a + b + c) / 3.0 + above * n);
        EXPECT_NEAR(glm::dot(put - a, n), haptics::kSkin_mm, 1e-9) << above;
    }
    const dvec3 far = 8.0 * glm::normalize(dvec3(1, 2, 3));
    EXPECT_EQ(off_the_faces(span, far), far);
}

} // namespace
} // namespace palpate::touch
