#include "engine/measure/measure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/measure/grids.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

Measured measured(MeasureKind kind, std::vector<glm::dvec3> points, const Volume& volume) {
    const Measure made{kind, std::move(points)};
    const Result<void> good = check(made);
    EXPECT_TRUE(good) << good.error().message;
    return measure(made, volume).value();
}

glm::dvec3 random_point(std::mt19937& random, double reach) {
    std::uniform_real_distribution<double> real(-reach, reach);
    return {real(random), real(random), real(random)};
}

TEST(Measure, LengthsAndAnglesAreThoseOfWorldPoints) {
    const Volume volume = noise_volume(make_grid(glm::uvec3(4), glm::dvec3(1)));
    EXPECT_DOUBLE_EQ(*measured(MeasureKind::ruler, {{1, 2, 3}, {4, 6, 15}}, volume).length_mm,
                     13.0);
    // By the law of cosines, an independent formula: near 90 degrees it is good to 1e-12.
    std::mt19937 random(1);
    for (int i = 0; i < 100; ++i) {
        const glm::dvec3 a = random_point(random, 100), b = random_point(random, 100),
                         c = random_point(random, 100);
        const double ab = glm::distance(a, b), bc = glm::distance(b, c), ac = glm::distance(a, c);
        const double expected = std::acos((ab * ab + bc * bc - ac * ac) / (2.0 * ab * bc));
        EXPECT_NEAR(*measured(MeasureKind::angle, {a, b, c}, volume).angle_deg,
                    glm::degrees(expected), 1e-6);
    }
    EXPECT_EQ(*measured(MeasureKind::angle, {{1, 0, 0}, {0, 0, 0}, {5, 0, 0}}, volume).angle_deg,
              0.0);
    EXPECT_EQ(*measured(MeasureKind::angle, {{1, 0, 0}, {0, 0, 0}, {-5, 0, 0}}, volume).angle_deg,
              180.0);
    const Measured none = measured(MeasureKind::angle, {{1, 0, 0}, {1, 0, 0}, {5, 0, 0}}, volume);
    EXPECT_FALSE(none.angle_deg);
    EXPECT_THAT(none.note, HasSubstr("no angle"));
}

// A regular polygon of n corners and radius r: n/2 r^2 sin(2 pi / n), in any plane; its sides are
// 2 r sin(pi / n).
TEST(Measure, AreaOfARegularPolygonInAnyPlane) {
    std::mt19937 random(2);
    const Volume volume = noise_volume(make_grid(glm::uvec3(4), glm::dvec3(1)));
    for (const int n : {3, 4, 7, 100}) {
        const glm::dvec3 normal = glm::normalize(random_point(random, 1)),
                         u = glm::normalize(glm::cross(normal, random_point(random, 1))),
                         v = glm::cross(normal, u), center = random_point(random, 200);
        const double r = 31.0;
        std::vector<glm::dvec3> corners;
        for (int i = 0; i < n; ++i)
            corners.push_back(
                center + r * (std::cos(2 * M_PI * i / n) * u + std::sin(2 * M_PI * i / n) * v));
        const Measured found = measured(MeasureKind::polygon, corners, volume);
        EXPECT_NEAR(*found.area_mm2, 0.5 * n * r * r * std::sin(2 * M_PI / n), 1e-8);
        EXPECT_NEAR(*found.length_mm, n * 2 * r * std::sin(M_PI / n), 1e-9);
        EXPECT_LT(glm::distance(plane_normal(corners), normal), 1e-9);
    }
    // An L of 3 + 2 squares, which is not convex.
    EXPECT_DOUBLE_EQ(
        *measured(MeasureKind::polygon,
                  {{0, 0, 5}, {3, 0, 5}, {3, 1, 5}, {1, 1, 5}, {1, 3, 5}, {0, 3, 5}}, volume)
             .area_mm2,
        5.0);
}

TEST(Measure, APolygonThatCrossesItselfHasNoArea) {
    const Volume volume = noise_volume(make_grid(glm::uvec3(4), glm::dvec3(1)));
    const Measured crossed =
        measured(MeasureKind::polygon, {{0, 0, 1}, {3, 3, 1}, {3, 0, 1}, {0, 2, 1}}, volume);
    EXPECT_FALSE(crossed.area_mm2);
    EXPECT_FALSE(crossed.values);
    EXPECT_THAT(crossed.note, HasSubstr("cross"));
    const Measured line = measured(MeasureKind::polygon, {{0, 0, 1}, {1, 1, 1}, {3, 3, 1}}, volume);
    EXPECT_EQ(line.area_mm2, 0.0);
    EXPECT_FALSE(line.values);
    EXPECT_THAT(line.note, HasSubstr("line"));
}

// Figures that turn about some points the other way or twice, through crossings of edges or through
// corners that meet, in any plane, order and place: none has an area, not even 0. Those that touch
// themselves and turn about each point once have theirs.
TEST(Measure, APolygonWithoutAnAreaIsToldFromOneOnALine) {
    const Volume volume = noise_volume(make_grid(glm::uvec3(4), glm::dvec3(1)));
    struct Figure {
        std::vector<glm::dvec2> corners;
        std::optional<double> area;
    };
    const Figure figures[] = {
        {{{0, 0}, {2, 2}, {2, 0}, {0, 2}}, {}},                 // a bow tie: areas cancel
        {{{0, 0}, {1, 1}, {2, 2}, {2, 0}, {1, 1}, {0, 2}}, {}}, // the same, by its corners
        {{{0, 0}, {4, 4}, {4, 0}, {0, 3}}, {}},                 // of two sizes
        {{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {2, 0}, {2, 2}, {0, 2}}, {}}, // a part twice
        {{{0, 3}, {2, -3}, {-3, 1}, {3, 1}, {-2, -3}}, {}},                     // a pentagram
        // A square with a hole that an edge leads to and back.
        {{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}, 15.0},
        // Two triangles that meet in a corner, and turn the same way.
        {{{0, 0}, {1, 1}, {0, 2}, {2, 2}, {1, 1}, {2, 0}}, 2.0},
        {{{0, 0}, {1, 1}, {2, 0}, {2, 2}, {1, 1}, {0, 2}}, 2.0},
    };
    std::mt19937 random(5);
    for (const Figure& figure : figures)
        for (int i = 0; i < 20; ++i) {
            const glm::dvec3 normal = glm::normalize(random_point(random, 1)),
                             u = glm::normalize(glm::cross(normal, random_point(random, 1))),
                             v = glm::cross(normal, u), place = random_point(random, 200);
            std::vector<glm::dvec3> corners;
            for (const glm::dvec2 c : figure.corners)
                corners.push_back(place + c.x * u + c.y * v);
            std::rotate(corners.begin(), corners.begin() + i % ptrdiff_t(corners.size()),
                        corners.end());
            if (i % 2)
                std::reverse(corners.begin(), corners.end());
            const Measured found = measured(MeasureKind::polygon, corners, volume);
            if (figure.area) {
                ASSERT_TRUE(found.area_mm2) << found.note;
                EXPECT_NEAR(*found.area_mm2, *figure.area, 1e-9); // places within 1e-13 mm
                continue;
            }
            EXPECT_FALSE(found.area_mm2) << *found.area_mm2;
            EXPECT_FALSE(found.values);
            EXPECT_THAT(found.note, HasSubstr("cross"));
        }
    // One whose areas cancel has a plane, too, and its corners lie in it or are refused.
    EXPECT_THAT(check({MeasureKind::polygon, {{0, 0, 0}, {2, 2, 0.5}, {2, 0, 0}, {0, 2, 0}}, {}})
                    .error()
                    .message,
                HasSubstr("in one plane"));
}

void expect_values(const ValueStatistics& found, std::vector<double> values, double no_data) {
    ASSERT_EQ(found.count, values.size());
    EXPECT_EQ(static_cast<double>(found.no_data), no_data);
    if (values.empty()) {
        EXPECT_TRUE(std::isnan(found.mean) && std::isnan(found.min) && std::isnan(found.median));
        return;
    }
    const auto n = static_cast<double>(values.size());
    long double sum = 0, squares = 0;
    for (const double v : values)
        sum += v;
    const long double mean = sum / n;
    for (const double v : values)
        squares += (v - mean) * (v - mean);
    // Up to 1e5 whole numbers below 3001: double sums are exact to 1e-10.
    EXPECT_NEAR(found.mean, static_cast<double>(mean), 1e-8);
    if (values.size() > 1)
        EXPECT_NEAR(found.sd, static_cast<double>(std::sqrt(squares / (n - 1))), 1e-8);
    else
        EXPECT_TRUE(std::isnan(found.sd));
    // The definition, by counting.
    const auto expect_percentile = [&](double is, double share) {
        size_t not_above = 0, below = 0;
        for (const double v : values) {
            not_above += v <= is;
            below += v < is;
        }
        EXPECT_GE(static_cast<double>(not_above), share * n);
        EXPECT_LT(static_cast<double>(below), std::max(share * n, 1e-9));
    };
    expect_percentile(found.p5, 0.05);
    expect_percentile(found.median, 0.5);
    expect_percentile(found.p95, 0.95);
    EXPECT_EQ(found.min, *std::min_element(values.begin(), values.end()));
    EXPECT_EQ(found.max, *std::max_element(values.begin(), values.end()));
}

TEST(Measure, ASphereHoldsTheSamplesThatAllOfThemAreAskedFor) {
    std::mt19937 random(3);
    for (int i = 0; i < 40; ++i) {
        const Grid grid = random_grid(random);
        const Volume volume = noise_volume(grid);
        const glm::dvec3 center =
            world_point(grid, glm::dvec3(grid.size) * (0.6 * random_point(random, 1) + 0.5));
        const glm::dvec3 edge = center + random_point(random, 9.0);
        std::vector<double> inside;
        for_each_sample(grid, [&](glm::uvec3 at) {
            if (glm::distance(world_point(grid, glm::dvec3(at)), center) <=
                glm::distance(center, edge))
                inside.push_back(double{volume.value(at)});
        });
        expect_values(*measured(MeasureKind::sphere, {center, edge}, volume).values, inside, 0);
    }
}

// The mean of a linear field over a ball is the value at its centre. The samples stand for cells
// that differ from the ball by a shell of half a cell's diagonal d to each side of its surface, of
// the volume S = 4/3 pi ((r + d)^3 - (r - d)^3); values there differ from the centre's by at most
// |slope| (r + d).
TEST(Measure, VolumeAndMeanOfABallInARamp) {
    const glm::dvec3 spacing(0.5, 0.6, 1.5), slope(3.0, -2.0, 1.0);
    const Grid grid = make_grid({120, 100, 40}, spacing, {-30, -30, -30});
    const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return 100.0 + glm::dot(slope, world_point(grid, glm::dvec3(i)));
    });
    std::mt19937 random(4);
    for (int i = 0; i < 20; ++i) {
        const glm::dvec3 center = random_point(random, 10.0);
        const double r = 12.0, d = 0.5 * glm::length(spacing);
        const Measured found =
            measured(MeasureKind::sphere, {center, center + glm::dvec3(0, r, 0)}, volume);
        const auto ball = [](double radius) { return 4.0 / 3.0 * M_PI * std::pow(radius, 3); };
        EXPECT_NEAR(*found.radius_mm, r, 1e-12);
        EXPECT_NEAR(*found.volume_mm3, ball(r), 1e-9);
        const double samples =
            static_cast<double>(found.values->count) * spacing.x * spacing.y * spacing.z;
        EXPECT_GE(samples, ball(r - d));
        EXPECT_LE(samples, ball(r + d));
        const double shell = ball(r + d) - ball(r - d);
        EXPECT_NEAR(found.values->mean, 100.0 + glm::dot(slope, center),
                    glm::length(slope) * (r + d) * shell / ball(r - d));
        // And in fact far better: balls about a sample are symmetric, where none lies on the rim.
        const glm::dvec3 middle = world_point(grid, glm::round(index_point(grid, center)));
        const Measured exact =
            measured(MeasureKind::sphere, {middle, middle + glm::dvec3(0, 0, 12.1234)}, volume);
        EXPECT_NEAR(exact.values->mean, 100.0 + glm::dot(slope, middle), 1e-4); // f32
    }
}

// In a slice along the samples: the pixels whose centres lie inside.
TEST(Measure, APolygonInASliceHoldsItsPixels) {
    std::mt19937 random(5);
    for (int i = 0; i < 30; ++i) {
        Grid grid = make_grid({40, 30, 12}, {0.7, 0.9, 2.5}, {3, 4, 5});
        const Volume volume = noise_volume(grid);
        const double layer = static_cast<double>(random() % 12);
        // A triangle, in index space; off the layer by less than half.
        std::vector<glm::dvec3> index;
        std::uniform_real_distribution<double> x(-5.0, 45.0), y(-5.0, 35.0);
        const double off = 0.49 * (static_cast<double>(random() % 3) - 1.0);
        for (int k = 0; k < 3; ++k)
            index.emplace_back(x(random), y(random), layer + off);
        std::vector<glm::dvec3> corners;
        for (const glm::dvec3 p : index)
            corners.push_back(world_point(grid, p));
        std::vector<double> inside;
        for (uint32_t row = 0; row < 30; ++row)
            for (uint32_t column = 0; column < 40; ++column) {
                const glm::dvec2 p(column, row);
                double signs[3];
                for (size_t k = 0; k < 3; ++k) {
                    const glm::dvec2 a(index[k]), b(index[(k + 1) % 3]);
                    signs[k] = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
                }
                if ((signs[0] > 0 && signs[1] > 0 && signs[2] > 0) ||
                    (signs[0] < 0 && signs[1] < 0 && signs[2] < 0))
                    inside.push_back(
                        double{volume.value({column, row, static_cast<uint32_t>(layer)})});
            }
        expect_values(*measured(MeasureKind::polygon, corners, volume).values, inside, 0);
    }
}

// On any plane, by asking every sample: it is the nearest of its line along the steepest axis, and
// its foot lies on one side of all edges of a convex polygon.
TEST(Measure, AnObliquePolygonHoldsOneSampleOfEachLine) {
    std::mt19937 random(6);
    int held = 0;
    for (int i = 0; i < 40; ++i) {
        const Grid grid = random_grid(random);
        const Volume volume = noise_volume(grid);
        const glm::dvec3 normal = glm::normalize(random_point(random, 1)),
                         u = glm::normalize(glm::cross(normal, random_point(random, 1))),
                         v = glm::cross(normal, u),
                         center = world_point(
                             grid, glm::dvec3(grid.size) * (0.3 * random_point(random, 1) + 0.5));
        std::vector<glm::dvec3> corners;
        for (int k = 0; k < 5; ++k)
            corners.push_back(center + 9.0 * (std::cos(1.2566 * k) * u + std::sin(1.2566 * k) * v));
        const auto distance = [&](glm::dvec3 index) {
            return glm::dot(world_point(grid, index) - center, normal);
        };
        glm::dvec3 axis(0.0);
        double steepest = 0.0;
        for (int k = 0; k < 3; ++k) {
            glm::dvec3 step(0.0);
            step[k] = 1.0;
            const double rise = std::abs(distance(step) - distance(glm::dvec3(0.0)));
            if (rise > steepest) {
                steepest = rise;
                axis = step;
            }
        }
        std::vector<double> inside;
        for_each_sample(grid, [&](glm::uvec3 at) {
            const glm::dvec3 p(at);
            const double off = std::abs(distance(p));
            if (off > std::abs(distance(p + axis)) || off > std::abs(distance(p - axis)))
                return;
            const glm::dvec3 foot = world_point(grid, p);
            for (size_t k = 0; k < 5; ++k) {
                const glm::dvec3 edge = corners[(k + 1) % 5] - corners[k];
                if (glm::dot(glm::cross(edge, foot - corners[k]), normal) < 0.0)
                    return;
            }
            inside.push_back(double{volume.value(at)});
        });
        held += !inside.empty();
        expect_values(*measured(MeasureKind::polygon, corners, volume).values, inside, 0);
    }
    EXPECT_GT(held, 20);
}

TEST(Measure, WhereNoSampleLiesInsideItIsSaidAndNotZero) {
    const Grid grid = make_grid(glm::uvec3(5), glm::dvec3(2.0));
    const Volume volume = noise_volume(grid);
    for (const auto& [kind, points] :
         {std::pair<MeasureKind, std::vector<glm::dvec3>>(MeasureKind::sphere,
                                                          {{100, 0, 0}, {101, 0, 0}}),
          {MeasureKind::sphere, {{1, 1, 1}, {1.1, 1, 1}}}, // between samples
          {MeasureKind::polygon, {{0.5, 0.5, 2}, {1.5, 0.5, 2}, {1, 1.5, 2}}}}) {
        const Measured found = measured(kind, points, volume);
        EXPECT_EQ(found.values->count, 0u);
        EXPECT_TRUE(std::isnan(found.values->mean));
        EXPECT_EQ(found.note, "no sample lies inside");
    }
    const Volume no_data =
        make_volume(grid, ScalarType::f32, [](glm::uvec3) { return std::nan(""); });
    const Measured found = measured(MeasureKind::sphere, {{4, 4, 4}, {4, 4, 6.5}}, no_data);
    EXPECT_EQ(found.values->count, 0u);
    EXPECT_EQ(found.values->no_data, 7u); // the middle and its six neighbours
    EXPECT_EQ(found.note, "the samples inside hold no data");
}

TEST(Measure, WhatCannotBeMeasuredIsRefused) {
    const auto error = [](MeasureKind kind, std::vector<glm::dvec3> points) {
        const Result<void> good = check({kind, std::move(points)});
        return good ? std::string() : good.error().message;
    };
    EXPECT_THAT(error(MeasureKind::ruler, {{0, 0, 0}}), HasSubstr("expected 2 points, found 1"));
    EXPECT_THAT(error(MeasureKind::polygon, {{0, 0, 0}, {1, 0, 0}}), HasSubstr("3 to"));
    EXPECT_THAT(error(MeasureKind::ruler, {{0, 0, 0}, {NAN, 0, 0}}), HasSubstr("within"));
    EXPECT_THAT(error(MeasureKind::polygon, {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 1}}),
                HasSubstr("one plane"));
}

TEST(Measure, IsReadAsItIsWritten) {
    const Measure made{MeasureKind::polygon, {{0, 0, 0.1}, {9, 0, 0.1}, {9, 9, 0.1}}, "a \"b\""};
    const Json json = measure_json(made);
    JsonErrors errors{"f", {}};
    EXPECT_EQ(read_measure(JsonValue(json, "", errors)), made);
    EXPECT_FALSE(errors.first);
    const Json wrong = parse_json(R"({"kind": "ruler", "points_mm": [[0, 0, 0]]})", "f").value();
    read_measure(JsonValue(wrong, "measures[0]", errors));
    ASSERT_TRUE(errors.first);
    EXPECT_THAT(errors.first->message, HasSubstr("measures[0]"));
}

} // namespace
} // namespace palpate
