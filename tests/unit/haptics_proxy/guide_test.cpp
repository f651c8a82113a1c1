#include "haptics/proxy/guide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/volume/builder.h"
#include "engine/volume/grid.h"
#include "haptics/proxy/algorithms.h"

namespace palpate::haptics {
namespace {

using glm::dvec3;

TickOutput felt(Algorithm& guide, const TouchScene& scene, const TouchParameters& parameters,
                dvec3 at_mm, dvec3 velocity_mm_per_s = dvec3(0.0)) {
    return guide.tick({.tool = {at_mm},
                       .velocity_mm_per_s = velocity_mm_per_s,
                       .scene = &scene,
                       .parameters = &parameters});
}

// The distance to a ball of 10 mm, on uneven spacing and turned axes.
TouchScene ball_scene() {
    Grid grid = make_grid({40, 40, 24}, {1.0, 1.0, 1.7}, {-19.5, -19.5, -19.55});
    const double c = std::cos(0.4), s = std::sin(0.4);
    glm::dmat4 turn(1.0);
    turn[0][0] = c, turn[0][2] = s, turn[2][0] = -s, turn[2][2] = c;
    grid.world_from_index = turn * grid.world_from_index;
    TouchScene scene{.version = 1};
    scene.field[0] = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return glm::length(world_point(grid, dvec3(i))) - 10.0;
    });
    return scene;
}

TEST(Guide, InsideNothingIsFeltAndOutsideASpringToTheSurface) {
    const TouchScene scene = ball_scene();
    const TouchParameters parameters{.stiffness_n_per_m = 400.0, .yield_n = 1.0};
    const auto guide = make_guide_inside();
    for (const dvec3 way : {dvec3(1, 0, 0), dvec3(0, 0, -1), glm::normalize(dvec3(1, -2, 1.5))}) {
        EXPECT_EQ(felt(*guide, scene, parameters, 9.8 * way).force_n, dvec3(0.0));
        // The spline errs by some h^4 of the fourth derivative of r: h^4 / r^3 = 0.008 mm, and its
        // slope by as much a sample.
        const TickOutput near = felt(*guide, scene, parameters, 11.5 * way);
        EXPECT_LE(glm::length(near.force_n + 0.6 * way), 0.6 * 0.02);
        EXPECT_LE(glm::length(near.proxy.position_mm - 10.0 * way), 0.02);
        EXPECT_EQ(near.contact, Contact::touching);
        // From 2.5 mm on the force is T0.
        const TickOutput far = felt(*guide, scene, parameters, 14.0 * way);
        EXPECT_LE(glm::length(far.force_n + 1.0 * way), 0.02);
        EXPECT_EQ(far.contact, Contact::yielding);
    }
}

// A distance that is a third too steep, as one of a filter may be, and damping.
TEST(Guide, NoForceIsLargerThanT0) {
    TouchScene scene{.version = 1};
    const Grid grid = make_grid({32, 32, 32}, dvec3(1.0), dvec3(-15.5));
    scene.field[0] = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return 1.3 * (glm::length(world_point(grid, dvec3(i))) - 6.0);
    });
    const TouchParameters parameters{
        .stiffness_n_per_m = 400.0, .damping_n_s_per_m = 5.0, .yield_n = 1.0};
    for (const AlgorithmEntry* entry :
         {find_algorithm("guide-inside"), find_algorithm("guide-onto")}) {
        const auto guide = entry->make();
        double most_n = 0.0;
        for (double x = 6.0; x < 14.0; x += 0.05)
            most_n = std::max(
                most_n,
                glm::length(
                    felt(*guide, scene, parameters, {x, 0.3, 0.2}, {50.0, 0.0, 0.0}).force_n));
        EXPECT_NEAR(most_n, 1.0, 1e-9) << entry->name;
    }
}

TEST(Guide, FadesWhereTheDistanceHasNoData) {
    TouchScene scene = ball_scene();
    const Grid grid = scene.field[0]->grid();
    scene.field[0] = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        const dvec3 p = world_point(grid, dvec3(i));
        return std::abs(p.y) < 1.5 ? std::numeric_limits<double>::quiet_NaN()
                                   : glm::length(p) - 10.0;
    });
    const TouchParameters parameters{.stiffness_n_per_m = 400.0};
    const auto guide = find_algorithm("guide-inside")->make();
    dvec3 last_n(0.0);
    int unknown = 0;
    for (int tick = 0; tick < 400; ++tick) { // 0.1 mm a tick
        const TickOutput out =
            felt(*guide, scene, parameters, {13.0, -15.0 + 0.1 * std::min(tick, 300), 0.0});
        // The spring's own change is less than its stiffness times the hand's motion.
        if (tick > 0) {
            EXPECT_LE(glm::distance(out.force_n, last_n), 0.4 * 0.1 * 1.02 + 0.09) << tick;
        }
        unknown += out.contact == Contact::unknown;
        last_n = out.force_n;
    }
    EXPECT_GT(unknown, 30);
    EXPECT_GT(glm::length(last_n), 3.0);
}

TEST(Guide, OntoHoldsFromBothSidesAndDampsAcross) {
    const TouchScene scene = ball_scene();
    const TouchParameters parameters{.stiffness_n_per_m = 400.0, .damping_n_s_per_m = 2.0};
    const auto guide = make_guide_onto();
    EXPECT_NEAR(felt(*guide, scene, parameters, {9.0, 0, 0}).force_n.x, 0.4, 0.01);
    EXPECT_NEAR(felt(*guide, scene, parameters, {11.0, 0, 0}).force_n.x, -0.4, 0.01);
    const dvec3 moved = felt(*guide, scene, parameters, {11.0, 0, 0}, {30, 50, 0}).force_n;
    EXPECT_NEAR(moved.x, -0.4 - 2.0 * 0.03, 0.01);
    EXPECT_NEAR(moved.y, 0.0, 0.01); // free along it
}

// The work of the force along a closed way is 0: within the samples, across their faces, and beyond
// the volume. By Simpson's rule with steps of 0.01 mm; the force is continuous, and its derivative
// jumps at some hundred places by at most k / h: each costs k h_step^2.
TEST(Guide, ComesFromAPotential) {
    const TouchScene scene = ball_scene();
    const TouchParameters parameters{.stiffness_n_per_m = 400.0, .yield_n = 2.0};
    for (const auto& guide : {make_guide_inside(), make_guide_onto()}) {
        constexpr int kSteps = 40000;
        const auto place = [](double turn) {
            const double a = 2.0 * M_PI * turn;
            return dvec3(17.0 * std::cos(a) + 6.0, 14.0 * std::sin(a), 16.0 * std::sin(2.0 * a));
        };
        double work_mj = 0.0, most_mj = 0.0;
        for (int i = 0; i < kSteps; ++i) {
            const dvec3 from = place(double(i) / kSteps), to = place((i + 1.0) / kSteps);
            const dvec3 middle = place((i + 0.5) / kSteps);
            const dvec3 force = (felt(*guide, scene, parameters, from).force_n +
                                 4.0 * felt(*guide, scene, parameters, middle).force_n +
                                 felt(*guide, scene, parameters, to).force_n) /
                                6.0;
            work_mj += glm::dot(force, to - from);
            most_mj = std::max(most_mj, std::abs(work_mj));
        }
        EXPECT_GT(most_mj, 5.0);
        EXPECT_LT(std::abs(work_mj), 2e-3 * most_mj);
    }
}

TEST(Guide, WithoutAFieldTheToolIsFree) {
    const TouchScene scene{.version = 1};
    const TickOutput output = felt(*make_guide_inside(), scene, {}, {1, 2, 3});
    EXPECT_EQ(output.force_n, dvec3(0.0));
    EXPECT_EQ(output.contact, Contact::free);
}

} // namespace
} // namespace palpate::haptics
