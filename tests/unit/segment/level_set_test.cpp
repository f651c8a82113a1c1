#include "engine/segment/level_set.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/segment/level_set_speed.h"
#include "engine/segment/packed_floats.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "engine/volume/synthetic.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

using testing::HasSubstr;
using End = LevelSetReport::End;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kMany = 100000;

Volume sampled(const Grid& grid, const std::function<double(glm::dvec3 mm)>& value) {
    return make_volume(grid, ScalarType::f32,
                       [&](glm::uvec3 i) { return value(world_point(grid, glm::dvec3(i))); });
}

// Signed distance of a ball about the middle of the grid.
Volume ball(const Grid& grid, double radius_mm) {
    return sampled(
        grid, [&, c = center_mm(grid)](glm::dvec3 p) { return glm::distance(p, c) - radius_mm; });
}

LevelSetResult run(const LevelSetStart& start, const LevelSetForces& forces,
                   LevelSetOptions options) {
    options.with_distance = true;
    Result<LevelSetResult> made = level_set(start, forces, options, {});
    EXPECT_TRUE(made) << made.error().message;
    return std::move(*made);
}

// How far phi is from the distance to a ball about the middle, within a sample of the surface.
struct Off {
    double mean = 0.0, most = 0.0;
};
Off off_ball(const Volume& phi, double radius_mm) {
    Off off;
    size_t count = 0;
    const glm::dvec3 h = spacing_mm(phi.grid()), c = center_mm(phi.grid());
    const double near = std::min({h.x, h.y, h.z});
    for (const glm::ivec3 i : twin::indices(glm::ivec3(phi.size()))) {
        const double found = phi.value(glm::uvec3(i));
        if (!(std::abs(found) < near))
            continue;
        const double by =
            glm::distance(world_point(phi.grid(), glm::dvec3(i)), c) - radius_mm - found;
        off.mean += by;
        off.most = std::max(off.most, std::abs(by));
        ++count;
    }
    EXPECT_GT(count, 0u);
    off.mean /= double(count);
    return off;
}

// A distance of first order, which a sample has as it comes in, is off by no more than this beside
// a surface of a radius: the plane through its neighbours instead of a ball.
double first_order(double h, double radius_mm) {
    return h * h / (2.0 * radius_mm);
}

// Central differences of a distance have a relative error of about h^2 / r^2 in its curvature
// (third derivatives are at most 1.2 / r^2), and dr is that curvature times dt: the integral of h^2
// / r^2 over the way. And a sample takes one distance of first order.
double most_off_curvature(double h, double from_mm, double to_mm) {
    return h * h * (1.0 / to_mm - 1.0 / from_mm) + first_order(h, to_mm);
}

// LevelSet takes over 5 s of a processor: surfaces turn once round in volumes of two resolutions,
// which shows the order of the error.
TEST(LevelSet, ABallShrinksUnderItsCurvature) {
    for (const double h : {2.0, 1.0}) {
        const Grid grid = make_grid(glm::uvec3(uint32_t(std::round(32 / h)) + 1), glm::dvec3(h));
        const Volume start = ball(grid, 12.0);
        const LevelSetResult made = run({.distance = &start}, {},
                                        {.propagation = 0,
                                         .curvature_mm = 1,
                                         .most_iterations = kMany,
                                         .last_time = (144.0 - 36.0) / 4.0});
        EXPECT_EQ(made.report.end, End::time);
        const Off by = off_ball(*made.distance, 6.0); // r^2 = r0^2 - 4 t
        std::printf("curvature, %g mm: radius off by %.3f mm, at most %.3f\n", h, by.mean, by.most);
        EXPECT_LE(std::abs(by.mean), most_off_curvature(h, 12.0, 6.0));
        EXPECT_LE(by.most, most_off_curvature(h, 12.0, 6.0) + first_order(h, 6.0));
    }
}

TEST(LevelSet, ABallGrowsAndShrinksAtItsSpeedOnAnyGrid) {
    for (const Grid& grid :
         {make_grid({48, 48, 48}, {1, 1, 1}), make_grid({66, 60, 20}, {0.7, 0.8, 2.4}),
          twin::turned({60, 60, 40}, {0.8, 0.8, 1.2}, false),
          twin::turned({60, 60, 40}, {0.8, 0.8, 1.2}, true)})
        for (const double speed : {1.0, -1.0}) {
            const Volume start = ball(grid, speed > 0 ? 6.0 : 16.0);
            const LevelSetResult made =
                run({.distance = &start}, {},
                    {.propagation = speed, .most_iterations = kMany, .last_time = 10});
            const Off by = off_ball(*made.distance, speed > 0 ? 16.0 : 6.0);
            const glm::dvec3 h = spacing_mm(grid);
            const double longest = std::max({h.x, h.y, h.z});
            std::printf("speed %g: radius off by %.3f mm, at most %.3f\n", speed, by.mean, by.most);
            // One distance of first order beside the smallest ball, and at a sample another.
            EXPECT_LE(std::abs(by.mean), first_order(longest, 6.0));
            EXPECT_LE(by.most, 2.0 * first_order(longest, 6.0));
        }
}

// The distance of a torus about the middle.
Volume torus(const Grid& grid, double ring_mm, double tube_mm) {
    return sampled(grid, [field = synthetic::torus(center_mm(grid), ring_mm, tube_mm)](
                             glm::dvec3 p) { return -field.value(p); });
}

// A look on the way is the surface after that iteration, which `moved` gives, too.
TEST(LevelSet, ALookIsTheSurfaceOnItsWay) {
    const Volume start = torus(make_grid({61, 61, 31}, {1, 1, 1}), 14, 6);
    std::vector<Volume> looks, moved;
    const Task task{{}, {}, [&](const std::function<Volume()>& make) { looks.push_back(make()); }};
    LevelSetOptions options{.most_iterations = 5};
    options.every = 1;
    options.moved = [&](const Volume& labels, const LevelSetReport&) { moved.push_back(labels); };
    ASSERT_TRUE(level_set({.distance = &start}, {}, options, task));
    ASSERT_EQ(looks.size(), 5u);
    ASSERT_EQ(moved.size(), 5u);
    for (size_t i = 0; i < looks.size(); ++i)
        EXPECT_EQ(content_hash(looks[i]), content_hash(moved[i]));
    EXPECT_NE(content_hash(looks[0]), content_hash(looks[4]));
}

// Moves a torus, and tells when its hole closed (infinite: never).
LevelSetResult move_torus(double tube_mm, LevelSetOptions options, double& closed) {
    const Grid grid = make_grid({61, 61, 31}, {1, 1, 1});
    const Volume start = torus(grid, 14, tube_mm);
    closed = std::numeric_limits<double>::infinity();
    options.most_iterations = kMany;
    options.every = 1;
    options.moved = [&](const Volume& labels, const LevelSetReport& report) {
        if (labels.value(grid.size / 2u) != 0 && !std::isfinite(closed))
            closed = report.time;
    };
    return run({.distance = &start}, {}, options);
}

TEST(LevelSet, ARingClosesWhereItsTubesMeetAndVanishesWhereTheTubeIsGone) {
    double closed = 0.0;
    EXPECT_EQ(move_torus(6, {.last_time = 9}, closed).report.end, End::time);
    // A ridge of distances lies on the axis, where a correction may be wrong by all of it, a
    // quarter of a sample; and a time step.
    EXPECT_NEAR(closed, 14.0 - 6.0, 0.25 + 1.0 / 6.0);
    const LevelSetReport gone = move_torus(6, {.propagation = -1}, closed).report;
    EXPECT_EQ(gone.end, End::vanished);
    EXPECT_FALSE(std::isfinite(closed));
    // It is gone once the tube lies between samples, at a radius of up to half a diagonal.
    EXPECT_GE(gone.time, 6.0 - std::sqrt(0.5) - first_order(1.0, 6.0));
    EXPECT_LE(gone.time, 6.0 + 1.0 / 6.0 + first_order(1.0, 6.0));
}

TEST(LevelSet, UnderCurvatureAThinRingGoesAndAThickOneCloses) {
    // A long cylinder goes at t = a^2 / 2; the ring's own bend has a share of (a / R)^2 in that.
    double closed = 0.0;
    const LevelSetReport thin = move_torus(4, {.propagation = 0, .curvature_mm = 1}, closed).report;
    EXPECT_EQ(thin.end, End::vanished);
    EXPECT_FALSE(std::isfinite(closed));
    EXPECT_NEAR(thin.time, 8.0, 8.0 * (4.0 / 14) * (4.0 / 14));
    // On the inner side of the hole, of 3 mm, curvature is 1 / 11 - 1 / 3 per mm: it closes, faster
    // the smaller it is, long before the ball that is left then has gone.
    const LevelSetReport thick =
        move_torus(11, {.propagation = 0, .curvature_mm = 1}, closed).report;
    EXPECT_EQ(thick.end, End::vanished);
    EXPECT_LT(closed, thick.time / 2);
}

// A flow that turns about the middle of x and y, once round in 2 pi.
VectorField turning(const Grid& grid) {
    return {sampled(grid, [](glm::dvec3 p) { return 50 - p.y; }),
            sampled(grid, [](glm::dvec3 p) { return p.x - 50; }),
            sampled(grid, [](glm::dvec3) { return 0.0; })};
}
LevelSetResult turn_once(const Volume& start, const VectorField& flow) {
    return run({.distance = &start}, {.flow = &flow},
               {.propagation = 0, .most_iterations = kMany, .last_time = 2 * M_PI});
}

TEST(LevelSet, ABallIsCarriedOnceRound) {
    // Below a distance of first order, and better than first order: half the spacing has less than
    // half the error (of third order in space and second in time, it is to have a quarter or less).
    double coarse_rms = 1e9, coarse_most = 1e9;
    for (const double h : {2.0, 1.0}) {
        const Grid grid = make_grid(glm::uvec3(glm::dvec3(100, 100, 36) / h) + 1u, glm::dvec3(h));
        const glm::dvec3 c(50, 75, 18);
        const Volume start = sampled(grid, [&](glm::dvec3 p) { return glm::distance(p, c) - 12; });
        const LevelSetResult made = turn_once(start, turning(grid));
        double squares = 0, most = 0;
        size_t count = 0;
        for (const glm::ivec3 i : twin::indices(glm::ivec3(grid.size))) {
            const double found = made.distance->value(glm::uvec3(i));
            if (std::abs(found) >= h)
                continue;
            const double by = start.value(glm::uvec3(i)) - found;
            squares += by * by, most = std::max(most, std::abs(by)), ++count;
        }
        const double rms = std::sqrt(squares / double(count));
        std::printf("carried ball, %g mm: off by %.3f mm RMS, at most %.3f\n", h, rms, most);
        EXPECT_LE(rms, first_order(h, 12.0));
        EXPECT_LE(rms, coarse_rms / 2);
        EXPECT_LE(most, coarse_most / 2);
        coarse_rms = rms, coarse_most = most;
    }
}

// Zalesak's slotted ball, once round: how its volume changed, and the samples that differ, as
// shares of its own.
struct Turned {
    double volume = 0.0, different = 0.0;
};
Turned turn_slotted_ball(double h) {
    const Grid grid = make_grid(glm::uvec3(glm::dvec3(100, 100, 40) / h) + 1u, glm::dvec3(h));
    const Volume start = sampled(grid, [](glm::dvec3 p) {
        const glm::dvec3 d = p - glm::dvec3(50, 75, 20);
        return std::max(glm::length(d) - 15, -std::max(std::abs(d.x) - 2.5, d.y - 10.0));
    });
    const LevelSetResult made = turn_once(start, turning(grid));
    double before = 0, after = 0, different = 0;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(grid.size))) {
        const bool a = start.value(glm::uvec3(i))<0, b = made.labels.value(glm::uvec3(i))> 0;
        before += a, after += b, different += a != b;
    }
    return {after / before - 1, different / before};
}

TEST(LevelSet, ASlottedBallTurnsOnceRound) {
    const Turned coarse = turn_slotted_ball(2.0), fine = turn_slotted_ball(1.0);
    std::printf(
        "slotted ball: volume %+.2f %% and %+.2f %%, samples that differ %.1f %% and "
        "%.1f %% at 2 and 1 mm\n",
        100 * coarse.volume, 100 * fine.volume, 100 * coarse.different, 100 * fine.different);
    // Its 220 mm of right-angled edges are rounded, to a radius of no more than 1.5 samples: that
    // is (1 - pi / 4) 1.5^2 of 10900 mm^3 for each mm.
    EXPECT_LE(std::abs(fine.volume), 220 * (1 - M_PI / 4) * 2.25 / 10900);
    // Half a sample everywhere on its 3600 mm^2, the slot's walls with them; and of first order.
    EXPECT_LE(fine.different, 3600 * 0.5 / 10900);
    EXPECT_LE(fine.different, coarse.different / 2);
}

// Packed floats move the surface as the floats do that they stand for.
TEST(LevelSet, TakesAFlowOfPackedFloats) {
    const Grid grid = make_grid({70, 40, 34}, {1, 1.5, 1});
    const VectorField exact = turning(grid);
    const auto each = [&](int k, ScalarType type, const auto& value) {
        return make_volume(grid, type,
                           [&](glm::uvec3 i) { return value(exact[size_t(k)].value(i)); });
    };
    const auto packed = [](float v) { return double(packed_float(v)); };
    const auto rounded = [](float v) { return double(unpacked_float(packed_float(v))); };
    const VectorField halves{each(0, ScalarType::u16, packed), each(1, ScalarType::u16, packed),
                             each(2, ScalarType::u16, packed)},
        floats{each(0, ScalarType::f32, rounded), each(1, ScalarType::f32, rounded),
               each(2, ScalarType::f32, rounded)};
    const Volume start =
        sampled(grid, [](glm::dvec3 p) { return glm::distance(p, glm::dvec3(35, 30, 17)) - 9; });
    const LevelSetOptions options{.propagation = 0, .most_iterations = kMany, .last_time = 0.2};
    const LevelSetResult a = run({.distance = &start}, {.flow = &halves}, options),
                         b = run({.distance = &start}, {.flow = &floats}, options);
    EXPECT_GT(a.report.iterations, 5);
    EXPECT_TRUE(twin::same_bits(a.labels, b.labels));
    EXPECT_TRUE(twin::same_bits(*a.distance, *b.distance));
    EXPECT_FALSE(twin::same_bits(*a.distance, *run({.distance = &start}, {}, options).distance));
}

TEST(LevelSet, PackedFloatsAreTheNearest) {
    for (const float v : {1.0f, -1.0f, 0.1f, -3.14159f, 1e-30f, 65504.5f, 1.00390625f}) {
        const float p = unpacked_float(packed_float(v));
        EXPECT_LE(std::abs(p - v), std::abs(v) / 256) << v;
        // No neighbour is nearer.
        for (const int to : {-1, 1})
            EXPECT_LE(std::abs(p - v), std::abs(unpacked_float(uint16_t(packed_float(v) + to)) - v))
                << v;
    }
    EXPECT_TRUE(std::isnan(unpacked_float(packed_float(NAN))));
}

// Grey values with a bright ball, an edge and a flow.
struct Scene {
    Volume seeds, speed, edge;
    VectorField flow;
};
Scene scene(const Grid& grid, ScalarType type, glm::dvec3 middle, double shift = 0.0) {
    const Volume grey = make_volume(grid, type, [&](glm::uvec3 i) {
        const glm::dvec3 d = glm::dvec3(i) - middle;
        return std::round(100.0 / (1.0 + std::exp(glm::length(d) - 8 + std::sin(d.x)))) + shift;
    });
    const auto flow = [&](int k) {
        return make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            return 0.1 * std::cos(0.3 * (double(i[k]) - middle[k]));
        });
    };
    return {make_volume(grid, ScalarType::u8,
                        [&](glm::uvec3 i) { return glm::distance(glm::dvec3(i), middle) < 4; }),
            threshold_speed(grey, {40 + shift, 160 + shift}, {}).value(),
            edge_speed(grey, {10.0, 2.0, 1.0}, {}).value(),
            {flow(0), flow(1), flow(2)}};
}
LevelSetResult run(const Scene& s, int iterations) {
    return run({.labels = &s.seeds}, {.speed = &s.speed, .edge = &s.edge, .flow = &s.flow},
               {.curvature_mm = 0.3, .advection_mm = 0.5, .most_iterations = iterations});
}

TEST(LevelSet, BricksChangeNoBit) {
    // The same scene in the middle of a brick and on a corner of eight.
    const Grid grid = make_grid({64, 64, 64}, {0.7, 0.8, 1.1});
    const LevelSetResult within = run(scene(grid, ScalarType::f32, {16, 16, 16}), 60);
    const LevelSetResult across = run(scene(grid, ScalarType::f32, {32, 33, 31}), 60);
    EXPECT_NEAR(within.report.change_mm, across.report.change_mm, 1e-12); // sums by bricks
    for (const glm::ivec3 i : twin::indices({32, 32, 32})) {
        const glm::uvec3 there = glm::uvec3(i) + glm::uvec3(16, 17, 15);
        ASSERT_EQ(within.distance->value(glm::uvec3(i)), across.distance->value(there));
        ASSERT_EQ(within.labels.value(glm::uvec3(i)), across.labels.value(there));
    }
    EXPECT_GT(within.report.iterations, 20);
}

TEST(LevelSet, TypesAndThreadsChangeNoBit) {
    const Grid grid = make_grid({70, 40, 40}, {1, 1, 1});
    const LevelSetResult first = run(scene(grid, ScalarType::u8, {33, 20, 20}), 40);
    EXPECT_TRUE(twin::same_bits(*first.distance,
                                *run(scene(grid, ScalarType::i16, {33, 20, 20}), 40).distance));
    for (const size_t threads : {1u, 2u, 4u}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const LevelSetResult found = run(scene(grid, ScalarType::f32, {33, 20, 20}), 40);
        EXPECT_TRUE(twin::same_bits(*first.distance, *found.distance));
        EXPECT_TRUE(twin::same_bits(first.labels, found.labels));
        EXPECT_EQ(first.report.change_mm, found.report.change_mm);
    }
}

TEST(LevelSet, NeverEntersWhatHasNoData) {
    // A room of 20 x 12 x 12 with walls a sample thick, and a pillar in it.
    const Grid grid = make_grid({40, 20, 20}, {1, 1, 1.5});
    const auto is_wall = [](glm::uvec3 i) {
        const bool around = i.x == 8 || i.x == 29 || i.y == 3 || i.y == 16 || i.z == 3 || i.z == 16;
        const bool pillar = i.x >= 20 && i.x < 23 && i.y >= 8 && i.y < 11;
        return around || pillar;
    };
    const Volume speed =
        make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) { return is_wall(i) ? kNone : 1.0; });
    const Volume seeds = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return glm::distance(glm::dvec3(i), glm::dvec3(13, 9, 9)) < 3;
    });
    const LevelSetResult made =
        run({.labels = &seeds}, {.speed = &speed}, {.most_iterations = kMany});
    EXPECT_EQ(made.report.end, End::vanished); // it fills the room: no surface is left
    for (const glm::ivec3 at : twin::indices(glm::ivec3(grid.size))) {
        const glm::uvec3 i(at);
        const bool within = i.x > 8 && i.x < 29 && i.y > 3 && i.y < 16 && i.z > 3 && i.z < 16;
        ASSERT_EQ(made.labels.value(i), within && !is_wall(i) ? 1.0f : 0.0f)
            << i.x << " " << i.y << " " << i.z;
        ASSERT_EQ(std::isnan(made.distance->value(i)), is_wall(i));
    }
}

TEST(LevelSet, SettlesOnTheEdgeOfABall) {
    // Speed 0 at a distance of 10 mm from the middle.
    const Grid grid = make_grid({40, 40, 27}, {0.8, 0.8, 1.2});
    const glm::dvec3 c = center_mm(grid);
    const Volume speed = sampled(
        grid, [&](glm::dvec3 p) { return std::clamp(10 - glm::distance(p, c), -1.0, 1.0); });
    const Volume start = ball(grid, 4.0);
    const LevelSetResult made = run({.distance = &start}, {.speed = &speed},
                                    {.most_iterations = 1000, .tolerance_mm = 1e-4});
    EXPECT_EQ(made.report.end, End::settled);
    EXPECT_LE(made.report.change_mm, 1e-4);
    EXPECT_THAT(text_of(made.report), HasSubstr("settled after"));
    for (const glm::ivec3 i : twin::indices(glm::ivec3(grid.size))) {
        const double d = glm::distance(world_point(grid, glm::dvec3(i)), c);
        if (std::abs(d - 10) > 0.05) { // slower than a twentieth of the speed there
            ASSERT_EQ(made.labels.value(glm::uvec3(i)), d < 10 ? 1.0f : 0.0f) << d;
        }
    }
}

TEST(LevelSet, GoesOnThinVolumes) {
    // A disc: k = 1 / r, r^2 = r0^2 - 2 t.
    const Grid sheet = make_grid({40, 40, 1}, {1, 1, 1});
    const Volume disc = ball(sheet, 15.0);
    const LevelSetResult made =
        run({.distance = &disc}, {},
            {.propagation = 0, .curvature_mm = 1, .most_iterations = kMany, .last_time = 72});
    EXPECT_LE(std::abs(off_ball(*made.distance, 9.0).mean), most_off_curvature(1.0, 15.0, 9.0));
    // A stretch of a line grows by its time on both ends.
    const Grid line = make_grid({1, 70, 1}, {1, 0.5, 1});
    const Volume seed = make_volume(line, ScalarType::u16,
                                    [](glm::uvec3 i) { return i.y >= 30 && i.y < 34 ? 7.0 : 0.0; });
    const LevelSetResult grown =
        run({.labels = &seed, .label = 7}, {}, {.most_iterations = kMany, .last_time = 5.0});
    for (uint32_t y = 0; y < 70; ++y)
        EXPECT_EQ(grown.labels.value({0, y, 0}), y >= 20 && y < 44 ? 1.0f : 0.0f) << y;
    const Volume one = make_volume(make_grid({1, 1, 1}, {1, 1, 1}), ScalarType::u8,
                                   [](glm::uvec3) { return 1.0; });
    EXPECT_EQ(run({.labels = &one}, {}, {}).report.end, End::vanished);
}

// The surface comes to rest where its speed is 0, and that is between samples: signed distances of
// balls whose values pass 100 at their radius, on unequal spacings of up to twice the blur of the
// edge, from seeds in their middle.
TEST(LevelSet, DistancesAreRightWhereItComesToRest) {
    for (const auto& [radius_mm, spacing] :
         {std::pair(7.0, glm::dvec3(1.0, 1.1, 1.4)), std::pair(9.0, glm::dvec3(0.7, 0.9, 1.4))})
        for (const double blur_mm : {0.7, 1.5}) {
            const Grid grid = make_grid(
                glm::uvec3(glm::ceil(glm::dvec3(2.0 * radius_mm + 9.0) / spacing)), spacing);
            const glm::dvec3 middle = center_mm(grid) + glm::dvec3(0.3, -0.2, 0.4);
            const auto away = [&, r = radius_mm](glm::dvec3 p) {
                return glm::distance(p, middle) - r;
            };
            const Volume values = sampled(grid, [&](glm::dvec3 p) {
                return 100.0 * std::erfc(away(p) / (std::sqrt(2.0) * blur_mm));
            });
            const Volume speed = *threshold_speed(values, {100.0, 300.0}, {});
            const Volume start =
                sampled(grid, [&](glm::dvec3 p) { return glm::distance(p, middle) - 4.0; });
            const LevelSetResult made =
                run({.distance = &start}, {.speed = &speed}, {.tolerance_mm = 0.002});
            EXPECT_EQ(made.report.end, End::settled);
            const double reach = 1.9 * std::min({spacing.x, spacing.y, spacing.z});
            double squares = 0.0, count = 0.0;
            for (const glm::ivec3 i : twin::indices(glm::ivec3(grid.size))) {
                const double expected = away(world_point(grid, glm::dvec3(i)));
                if (std::abs(expected) > reach)
                    continue;
                const double off = made.distance->value(glm::uvec3(i)) - expected;
                squares += off * off, ++count;
            }
            EXPECT_LE(std::sqrt(squares / count), 0.1) << radius_mm << " " << blur_mm;
        }
}

TEST(LevelSet, RefusesWhatDoesNotFitAndEndsWhenItIsStopped) {
    const Grid grid = make_grid({9, 9, 9}, {1, 1, 1});
    const Volume start = ball(grid, 3.0), none = ball(grid, -1.0);
    const Volume other = ball(make_grid({8, 9, 9}, {1, 1, 1}), 3.0);
    const Volume whole = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 1.0; });
    const auto why = [&](const LevelSetStart& s, const LevelSetForces& f,
                         const LevelSetOptions& o) {
        const Result<LevelSetResult> made = level_set(s, f, o, {});
        return made ? "" : made.error().message;
    };
    EXPECT_THAT(why({.distance = &none}, {}, {}), HasSubstr("no sample to start from"));
    EXPECT_THAT(why({.labels = &whole, .label = 2}, {}, {}), HasSubstr("no sample to start from"));
    EXPECT_THAT(why({.distance = &start}, {.speed = &other}, {}),
                HasSubstr("the speed has another"));
    EXPECT_THAT(why({.distance = &start}, {.edge = &whole}, {}),
                HasSubstr("of type f32, found u8"));
    EXPECT_THAT(why({.distance = &start}, {}, {.advection_mm = 1}), HasSubstr("expected an edge"));
    EXPECT_THAT(why({.distance = &start}, {}, {.curvature_mm = -1}), HasSubstr("found -1"));
    std::stop_source source;
    source.request_stop();
    EXPECT_EQ(level_set({.distance = &start}, {}, {}, {source.get_token(), {}}).error().message,
              stopped().value().message);
}

TEST(LevelSetSpeed, IsItsFormula) {
    const Grid grid = make_grid({5, 1, 1}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        return std::array{10.0, 20.0, 35.0, 900.0, kNone}[i.x];
    });
    const Volume band = threshold_speed(volume, {10, 30}, {}).value();
    EXPECT_FLOAT_EQ(band.value({0, 0, 0}), 0.0f);
    EXPECT_FLOAT_EQ(band.value({1, 0, 0}), 1.0f);
    EXPECT_FLOAT_EQ(band.value({2, 0, 0}), -0.5f);
    EXPECT_FLOAT_EQ(band.value({3, 0, 0}), -1.0f);
    EXPECT_TRUE(std::isnan(band.value({4, 0, 0})));
    EXPECT_THAT(threshold_speed(volume, {30, 30}, {}).error().message, HasSubstr("30 .. 30"));
    // By Bayes' rule.
    const Volume regions = region_speed(volume, {1, 9, 10, 5}, {2, 9, 30, 10}, {}).value();
    const auto p = [](double v, double mean, double sd) {
        return std::exp(-0.5 * (v - mean) * (v - mean) / (sd * sd)) / sd;
    };
    for (uint32_t x = 0; x < 3; ++x) {
        const double v = volume.value({x, 0, 0}), in = p(v, 10, 5), out = p(v, 30, 10);
        EXPECT_NEAR(regions.value({x, 0, 0}), (in - out) / (in + out), 1e-6);
    }
    EXPECT_TRUE(std::isnan(regions.value({4, 0, 0})));
    // A slope of 6 along z with an edge of 3: 1 / (1 + 2^2).
    const Volume ramp = make_volume(make_grid({5, 5, 9}, {1, 1, 0.5}), ScalarType::i16,
                                    [](glm::uvec3 i) { return 3.0 * i.z; });
    EXPECT_NEAR(edge_speed(ramp, {3, 2, 0}, {}).value().value({2, 2, 4}), 0.2, 1e-6);
}

} // namespace
} // namespace palpate
