#include "engine/segment/live_wire_surface.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/segment/smooth_interpolant.h"
#include "engine/segment/wire_curves.h"
#include "tests/unit/shape/random_labels.h"
#include "tests/unit/shape/wire_balls.h"

namespace palpate {
namespace {

using testing::HasSubstr;

WireCurve curve_of(const std::function<glm::dvec3(double turn)>& at, int points = 120) {
    WireCurve curve;
    for (int i = 0; i <= points; ++i)
        curve.points_mm.push_back(at(2.0 * std::numbers::pi * i / points));
    return curve;
}

struct Frame {
    glm::dvec3 x, y, z;
};
Frame frame_of(glm::dvec3 z) {
    z = glm::normalize(z);
    const glm::dvec3 x = glm::normalize(
        glm::cross(z, std::abs(z.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    return {x, glm::cross(z, x), z};
}

// The cut of the plane dot(normal, p) = offset with the unit ball, as a curve on an ellipsoid.
WireCurve cut_of_ellipsoid(glm::dvec3 normal, double offset, glm::dvec3 center, glm::dvec3 semi) {
    const Frame f = frame_of(normal);
    const double r = std::sqrt(1.0 - offset * offset);
    return curve_of([=](double a) {
        return center + semi * (offset * f.z + r * (std::cos(a) * f.x + std::sin(a) * f.y));
    });
}

// A slanted, turned grid with slices of 1.5 mm.
Grid oblique_grid(glm::uvec3 size, glm::dvec3 center) {
    Grid grid = make_grid(size, {0.9, 1.1, 1.5});
    const double c = std::cos(0.4), s = std::sin(0.4);
    const glm::dmat4 turn(c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
    grid.world_from_index = turn * grid.world_from_index;
    grid.world_from_index[2][0] += 0.3; // gantry tilt
    const glm::dvec3 middle = world_point(grid, glm::dvec3(size - 1u) * 0.5);
    grid.world_from_index[3] += glm::dvec4(center - middle, 0.0);
    return grid;
}

// Samples that paths over faces reach from one of them without those of the surface.
std::vector<bool> reached(const Volume& surface, glm::uvec3 from) {
    const glm::uvec3 n = surface.size();
    const std::vector<float> walls = samples_of(surface);
    std::vector<bool> seen(walls.size(), false);
    std::vector<glm::uvec3> queue{from};
    const auto number = [&](glm::uvec3 p) { return p.x + n.x * (p.y + size_t{n.y} * p.z); };
    seen[number(from)] = true;
    for (size_t i = 0; i < queue.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            for (const int by : {-1, 1}) {
                glm::uvec3 to = queue[i];
                to[axis] += uint32_t(by); // wraps round below 0
                if (to[axis] >= n[axis] || seen[number(to)] || walls[number(to)] != 0.0f)
                    continue;
                seen[number(to)] = true;
                queue.push_back(to);
            }
    return seen;
}

glm::uvec3 sample_at(const Grid& grid, glm::dvec3 mm) {
    return glm::uvec3(glm::round(index_point(grid, mm)));
}

// No path from a place within leads out; the body is the surface and what it keeps in; the curves
// are on it.
void expect_separates(const Grid& grid, const std::vector<WireCurve>& curves, glm::dvec3 inside_mm,
                      const LiveWireSurface& made) {
    const std::vector<bool> in = reached(made.surface, sample_at(grid, inside_mm));
    const std::vector<bool> out = reached(made.surface, glm::uvec3(0));
    const std::vector<float> surface = samples_of(made.surface), labels = samples_of(made.labels);
    for (size_t i = 0; i < in.size(); ++i) {
        ASSERT_FALSE(in[i] && out[i]) << "a path leads out";
        ASSERT_EQ(labels[i] != 0.0f, !out[i]);
        ASSERT_TRUE(surface[i] == 0.0f || labels[i] == surface[i]);
    }
    EXPECT_FALSE(out[0] && in[0]);
    // The surface is the inner one of the two samples that it runs between.
    for (const WireCurve& curve : curves)
        for (const glm::dvec3 p : curve.points_mm) {
            const glm::ivec3 at(sample_at(grid, p));
            bool near = false;
            for (int n = 0; n < 27 && !near; ++n) {
                const glm::uvec3 q(at + glm::ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
                near = glm::all(glm::lessThan(q, grid.size)) && made.surface.value(q) != 0.0f;
            }
            ASSERT_TRUE(near) << p.x << ' ' << p.y << ' ' << p.z;
        }
}

double share_wrong(const LiveWireSurface& made, const std::function<bool(glm::dvec3)>& inside) {
    const Grid& grid = made.labels.grid();
    const std::vector<float> labels = samples_of(made.labels);
    double wrong = 0.0, right = 0.0;
    for (size_t i = 0; i < labels.size(); ++i) {
        const bool wanted = inside(world_point(grid, glm::dvec3(index_of(grid.size, i))));
        wrong += wanted != (labels[i] != 0.0f);
        right += wanted;
    }
    return wrong / right;
}

TEST(SmoothInterpolant, HasItsValuesAndKeepsLinearFunctions) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(-40, 90);
    std::vector<glm::dvec3> places;
    std::vector<double> values, linear;
    for (int i = 0; i < 60; ++i) {
        places.emplace_back(place(random), place(random), place(random));
        values.push_back(place(random));
        linear.push_back(3.0 - 0.5 * places.back().x + 2.0 * places.back().z);
    }
    const SmoothInterpolant any(places, values), plane(places, linear);
    for (size_t i = 0; i < places.size(); ++i)
        EXPECT_NEAR(any(places[i]), values[i], 1e-9);
    EXPECT_NEAR(plane({7, -30, 55}), 3.0 - 3.5 + 110.0, 1e-8);
}

// Random planes through balls and ellipsoids, on slanted grids: each set has a great circle that
// all others cross.
TEST(LiveWireSurface, SeparatesForRandomCurvesOnEllipsoids) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> share(-1, 1);
    for (int set = 0; set < 12; ++set) {
        const glm::dvec3 semi(11 + 4 * share(random), 12 + 4 * share(random),
                              12 + 4 * share(random));
        const glm::dvec3 center(100 * share(random), 50, -70);
        const Grid grid = oblique_grid({64, 56, 46}, center);
        std::vector<WireCurve> curves{
            cut_of_ellipsoid({share(random), share(random), 1.0}, 0.0, center, semi)};
        const glm::dvec3 first(share(random), 1.0, 0.2 * share(random));
        curves.push_back(cut_of_ellipsoid(first, 0.1 * share(random), center, semi));
        for (int more = 0; more < set % 4; ++more)
            curves.push_back(cut_of_ellipsoid({1.0, share(random), 0.3 * share(random)},
                                              0.4 * share(random), center, semi));
        const Result<LiveWireSurface> made = live_wire_surface(grid, curves, {});
        ASSERT_TRUE(made) << set << ": " << made.error().message;
        expect_separates(grid, curves, center, *made);
    }
}

// Three great circles or nine: on the whole the surface is off by less than a quarter of a sample.
// Evening over two samples to each side draws a curve of radius r in by 2^2 / (6 r), 0.11 mm where
// the ellipsoid is sharpest; and samples are on one side or the other.
TEST(LiveWireSurface, IsTheBodyBetweenTheCurvesToo) {
    const glm::dvec3 semi(16, 12, 10);
    const Grid grid = make_grid({44, 36, 32}, {1, 1, 1}, {-21.5, -17.5, -15.5});
    for (const int meridians : {2, 8}) {
        std::vector<WireCurve> curves{cut_of_ellipsoid({0, 0, 1}, 0.0, {}, semi)};
        for (int k = 0; k < meridians; ++k) {
            const double a = (k + 0.25) * std::numbers::pi / meridians;
            curves.push_back(cut_of_ellipsoid({std::cos(a), std::sin(a), 0}, 0.0, {}, semi));
        }
        const Result<LiveWireSurface> made = live_wire_surface(grid, curves, {});
        ASSERT_TRUE(made) << made.error().message;
        // Its area is about 4 pi 12.7^2 mm^2, its volume 4/3 pi 16 12 10 mm^3.
        EXPECT_LT(share_wrong(*made, [&](glm::dvec3 p) { return glm::length(p / semi) <= 1.0; }),
                  0.25 * 2027.0 / 8042.0);
    }
}

// A ring: outlines of its tube, and lines along it outside, inside and on top, whose own planes
// cut it, touch it, or have it on their outer side.
TEST(LiveWireSurface, ARingStaysOpenInItsMiddle) {
    const double ring = 16.0, tube = 6.0;
    const Grid grid = oblique_grid({66, 58, 26}, {0, 0, 0});
    const auto on = [&](double u, double v) {
        const double r = ring + tube * std::cos(v);
        return glm::dvec3(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
    };
    std::vector<WireCurve> curves;
    for (const double v : {0.0, std::numbers::pi, 0.5 * std::numbers::pi})
        curves.push_back(curve_of([&](double u) { return on(u, v); }));
    for (int k = 0; k < 7; ++k)
        curves.push_back(
            curve_of([&](double v) { return on(2.0 * std::numbers::pi * k / 7.0, v); }));
    const Result<LiveWireSurface> made = live_wire_surface(grid, curves, {});
    ASSERT_TRUE(made) << made.error().message;
    expect_separates(grid, curves, {ring, 0, 0}, *made);
    EXPECT_EQ(made->labels.value(sample_at(grid, {0, 0, 0})), 0.0f);
    for (int k = 0; k < 40; ++k) // the whole ring is one
        EXPECT_EQ(made->labels.value(
                      sample_at(grid, {ring * std::cos(0.157 * k), ring * std::sin(0.157 * k), 0})),
                  1.0f);
    // Half a sample of 1.17 mm everywhere, area over volume being 2 / tube.
    EXPECT_LT(share_wrong(*made,
                          [&](glm::dvec3 p) {
                              return std::hypot(std::hypot(p.x, p.y) - ring, p.z) <= tube;
                          }),
              0.5 * 1.17 * 2.0 / tube);
}

// A live-wire follows a ball between a few points, each three samples off the edge.
TEST(LiveWireSurface, CurvesFollowEdgesBetweenPoints) {
    const Grid grid = make_grid({50, 50, 50}, {1, 1, 1}, {-24.5, -24.5, -24.5});
    const Volume ball = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return 100.0 / (1.0 + std::exp(glm::length(world_point(grid, glm::dvec3(i))) - 15.0));
    });
    const WireCurve points =
        curve_of([](double a) { return glm::dvec3(15 * std::cos(a), 15 * std::sin(a), 0.0); }, 5);
    const Result<WireCurve> wire = along_edges(ball, points, {}, {});
    ASSERT_TRUE(wire) << wire.error().message;
    EXPECT_GT(wire->points_mm.size(), 60u);
    for (const glm::dvec3 p : wire->points_mm)
        EXPECT_NEAR(glm::length(p), 15.0, 1.5); // the steepest samples, and their neighbours
}

// Small turned balls with sharp edges, on whose surface a wire of samples wanders; all 36 are in
// wire_balls_long_test.cpp. A surface half a sample off would have a Dice of 0.9.
TEST(LiveWireSurface, FindsBallsWithSharpEdges) {
    for (const int number : {1, 5, 9, 13})
        EXPECT_GE(wire_balls::dice_of(number), 0.97) << number;
}

TEST(LiveWireSurface, RefusesCurvesInOneSentence) {
    const Grid grid = make_grid({40, 40, 40}, {1, 1, 1}, {-20, -20, -20});
    const glm::dvec3 semi(10, 10, 10);
    const WireCurve equator = cut_of_ellipsoid({0, 0, 1}, 0, {}, semi);
    const WireCurve meridian = cut_of_ellipsoid({1, 0, 0}, 0, {}, semi);
    const auto why = [&](std::vector<WireCurve> curves) {
        const Result<LiveWireSurface> made = live_wire_surface(grid, curves, {});
        return made ? std::string() : made.error().message;
    };
    WireCurve open = meridian;
    open.points_mm.resize(60);
    EXPECT_THAT(why({equator, open}), HasSubstr("curve 2 does not close: its ends are"));
    WireCurve outside = meridian;
    outside.points_mm[30].z = 99.0;
    EXPECT_THAT(why({equator, outside}), HasSubstr("curve 2 leaves the volume at"));
    EXPECT_THAT(why({equator, cut_of_ellipsoid({0, 0, 1}, 0.6, {}, semi)}),
                HasSubstr("curve 1 does not meet another one of label 1: curve 2 is"));
    EXPECT_THAT(why({equator, equator}), HasSubstr("runs along curve 2"));
    EXPECT_THAT(why({equator}), HasSubstr("the only one of label 1"));
    EXPECT_THAT(why({}), HasSubstr("found none"));
    EXPECT_THAT(why({equator, WireCurve{1, {{0, 0, 0}, {1, 0, 0}}}}), HasSubstr("three points"));
    const WireCurve line{1, {{0, 0, 0}, {5, 0, 0}, {9, 0, 0}, {0, 0, 0}}};
    EXPECT_THAT(why({equator, line}), HasSubstr("runs around nothing"));
    WireCurve other = meridian;
    other.label = 2;
    EXPECT_THAT(why({equator, meridian, other}), HasSubstr("label 2"));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(live_wire_surface(grid, std::vector{equator, meridian}, {stop.get_token(), {}}));
}

TEST(LiveWireSurface, TwoBodiesAndWideLabels) {
    const Grid grid = make_grid({60, 30, 30}, {1, 1, 1}, {-30, -15, -15});
    std::vector<WireCurve> curves;
    for (const double x : {-14.0, 14.0})
        for (const glm::dvec3 normal : {glm::dvec3(0, 0, 1), {0, 1, 0}, {1, 0, 0}}) {
            curves.push_back(cut_of_ellipsoid(normal, 0, {x, 0, 0}, glm::dvec3(9.0)));
            curves.back().label = x < 0 ? 3 : 300;
        }
    const Result<LiveWireSurface> made = live_wire_surface(grid, curves, {});
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->labels.value({16, 15, 15}), 3.0f);
    EXPECT_EQ(made->labels.value({44, 15, 15}), 300.0f);
    EXPECT_EQ(made->labels.value({30, 15, 15}), 0.0f);
    for (WireCurve& curve : curves)
        curve.label = 1; // two bodies of one label
    EXPECT_EQ(live_wire_surface(grid, curves, {})->labels.value({44, 15, 15}), 1.0f);
}

} // namespace
} // namespace palpate
