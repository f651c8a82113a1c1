#include "engine/edit/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/edit/sample_mask.h"
#include "tests/unit/edit/random_edit.h"

namespace palpate {
namespace {

std::vector<std::pair<const char*, ShapePtr>> shapes() {
    return {{"capsule", make_capsule(1.0, 4.0)},
            {"cylinder", make_cylinder(2.0, 3.0)},
            {"box", make_box({2, 4, 6})},
            {"ellipsoid", make_ellipsoid({1, 2, 3})},
            {"burr", make_burr(3.0, 4, 0.6)},
            {"ball beside the tip", make_placed(make_ball(1.5), {3, 0, 0}, {1, 0, 0, 0}, 1.0)}};
}

// The least of the shape's function over very many poses between two.
double least(const Shape& shape, const StrokePose& from, const StrokePose& to, glm::dvec3 p,
             double* to_bounds = nullptr) {
    double value = 1e300;
    for (int i = 0; i <= 2000; ++i) {
        const StrokePose pose = pose_between(from, to, i / 2000.0);
        const glm::dvec3 q = glm::inverse(pose.tool.rotation) * (p - pose.tool.position_mm);
        value = std::min(
            value, std::max(shape.signed_mm(q), to_bounds ? shape.bounds().signed_mm(q) : -1e9));
    }
    return value;
}

// swept shape <= sweep <= swept shape and the tolerance.
TEST(Sweep, HoldsTheSweptShapeAndAtMostTheToleranceMore) {
    Random random(7);
    for (const auto& [name, shape] : shapes()) {
        const Tool tool{shape};
        int inside = 0, near = 0;
        for (int motion = 0; motion < 12; ++motion) {
            const Grid grid = random_grid(random, glm::uvec3(40));
            StrokePose from = random_pose(random, grid), to = from;
            to.tool.position_mm += 6.0 * random_direction(random);
            if (motion % 3)
                to.tool.rotation = random_turn(random);
            const Sweep sweep(tool, grid, from, to);
            const glm::dvec3 origin(grid.world_from_index[3]);
            // Truth is found at poses a 2000th apart: it may be too high by half of that motion.
            const double coarse = travel_mm(from, to, shape->bounds().reach_mm()) / 4000.0;
            for (int i = 0; i < 60; ++i) {
                const StrokePose on = pose_between(from, to, uniform(random, 0, 1));
                const glm::dvec3 p =
                    on.tool.position_mm + uniform(random, 0, 5) * random_direction(random);
                const bool found = sweep.at(p - origin).inside;
                double bounds = 0;
                const double truth = least(*shape, from, to, p, &bounds);
                if (truth <= -1e-9) {
                    EXPECT_TRUE(found) << name << " gap, " << truth;
                }
                if (truth > sweep.tolerance_mm() + coarse + 1e-9) {
                    EXPECT_FALSE(found) << name << " excess, " << truth;
                }
                inside += found;
                near += truth > 0 && truth < 0.5;
            }
        }
        EXPECT_GT(inside, 50) << name;
        EXPECT_GT(near, 10) << name;
    }
}

TEST(Sweep, VerdictsHoldAsFarAsTheySay) {
    Random random(8);
    auto all = shapes();
    all.emplace_back("ball", make_ball(2.5));
    for (const auto& [name, shape] : all) {
        const Tool tool{shape};
        int told = 0;
        for (int motion = 0; motion < 12; ++motion) {
            const Grid grid = random_grid(random, glm::uvec3(40));
            const StrokePose from = random_pose(random, grid);
            StrokePose to = from;
            if (motion % 4)
                to.tool.position_mm += 8.0 * random_direction(random);
            if (motion % 2)
                to.tool.rotation = random_turn(random);
            const Sweep sweep(tool, grid, from, to);
            const glm::dvec3 origin(grid.world_from_index[3]);
            for (int i = 0; i < 100; ++i) {
                const glm::dvec3 p =
                    pose_between(from, to, uniform(random, 0, 1)).tool.position_mm - origin +
                    uniform(random, 0, 8) * random_direction(random);
                const Sweep::Verdict verdict = sweep.at(p);
                told += verdict.same_within_mm > 0.1;
                const double r = (verdict.same_within_mm - 1e-6) * uniform(random, 0, 1);
                if (r > 0) {
                    ASSERT_EQ(sweep.at(p + r * random_direction(random)).inside, verdict.inside)
                        << name;
                }
            }
        }
        EXPECT_GT(told, 100) << name;
    }
}

TEST(Sweep, OfABallIsTheCapsule) {
    Random random(9);
    const Tool tool{make_ball(3.0)};
    for (int i = 0; i < 2000; ++i) {
        const Grid grid = random_grid(random, glm::uvec3(40));
        const StrokePose from = random_pose(random, grid), to = random_pose(random, grid);
        const glm::dvec3 p = random_pose(random, grid).tool.position_mm;
        const glm::dvec3 d = to.tool.position_mm - from.tool.position_mm;
        const double t =
            std::clamp(glm::dot(p - from.tool.position_mm, d) / glm::dot(d, d), 0.0, 1.0);
        const double distance = glm::length(p - from.tool.position_mm - t * d) - 3.0;
        if (std::abs(distance) < 1e-9) // rounding may turn it
            continue;
        EXPECT_EQ(Sweep(tool, grid, from, to).at(p - glm::dvec3(grid.world_from_index[3])).inside,
                  distance < 0);
    }
}

// Rows are filled in leaps; every sample asked for itself says the same.
TEST(Sweep, RowsAreWhatEverySampleSays) {
    Random random(10);
    for (const auto& [name, shape] : shapes())
        for (int motion = 0; motion < 4; ++motion) {
            const Grid grid = random_grid(random, {45, 40, 35});
            const Tool tool{shape, motion % 2 == 0};
            const StrokePose from = random_pose(random, grid);
            StrokePose to = random_pose(random, grid);
            if (motion == 3)
                to = from;
            const Sweep sweep(tool, grid, from, to);
            const glm::dmat3 mm(grid.world_from_index);
            const BrickRange range = bricks_of(sweep, grid);
            for (uint32_t bz = 0; bz < 2; ++bz)
                for (uint32_t by = 0; by < 2; ++by)
                    for (uint32_t bx = 0; bx < 2; ++bx) {
                        const glm::uvec3 brick(bx, by, bz);
                        const glm::uvec3 valid =
                            glm::min(glm::uvec3(kBrickSide), grid.size - brick * kBrickSide);
                        SampleMask mask;
                        add_samples(mask, sweep, grid, brick, valid);
                        if (!mask.empty()) {
                            EXPECT_TRUE(
                                glm::all(glm::lessThanEqual(range.low, glm::ivec3(brick))) &&
                                glm::all(glm::lessThanEqual(glm::ivec3(brick), range.high)));
                        }
                        for (uint32_t i = 0; i < kBrickSamples; i += motion == 0 ? 1 : 7) {
                            const glm::uvec3 local(i % 32, i / 32 % 32, i / 1024);
                            const glm::dvec3 index(brick * kBrickSide + local);
                            const bool expected =
                                glm::all(glm::lessThan(local, valid)) &&
                                (sweep.at(mm * index).inside ||
                                 (tool.marks_origin && passes_cell(grid, from, to, index)));
                            ASSERT_EQ(mask.has(local), expected) << name;
                        }
                    }
        }
}

// A point draws a line without holes: its samples are neighbours of one another.
TEST(Sweep, APointMarksEveryCellItPasses) {
    Random random(11);
    const Tool point{nullptr, true};
    for (int i = 0; i < 50; ++i) {
        const Grid grid = random_grid(random, glm::uvec3(32));
        const StrokePose from = random_pose(random, grid), to = random_pose(random, grid);
        SampleMask mask;
        add_samples(mask, Sweep(point, grid, from, to), grid, glm::uvec3(0), glm::uvec3(32));
        for (uint32_t s = 0; s < kBrickSamples; ++s) {
            const glm::uvec3 local(s % 32, s / 32 % 32, s / 1024);
            ASSERT_EQ(mask.has(local), passes_cell(grid, from, to, glm::dvec3(local)));
        }
        for (int k = 0; k <= 1000; ++k) { // wherever the tip is, its sample is marked
            const glm::dvec3 at = glm::round(index_point(
                grid, glm::mix(from.tool.position_mm, to.tool.position_mm, k / 1000.0)));
            if (glm::all(glm::greaterThanEqual(at, glm::dvec3(0))) &&
                glm::all(glm::lessThan(at, glm::dvec3(32)))) {
                EXPECT_TRUE(mask.has(glm::uvec3(at)));
            }
        }
    }
}

TEST(Sweep, WholeMillimetresOfOffsetChangeNothing) {
    Random random(12);
    const Tool tool{make_burr(3.0, 3, 0.5)};
    Grid grid = make_grid(glm::uvec3(32), {0.75, 0.5, 2.5});
    StrokePose from{0, {{8.25, 7.5, 30.5}, random_turn(random)}},
        to{1, {{12, 9, 40}, random_turn(random)}};
    SampleMask here, far;
    add_samples(here, Sweep(tool, grid, from, to), grid, glm::uvec3(0), glm::uvec3(32));
    const glm::dvec3 offset(9999999, -5000000, 1234567);
    grid.world_from_index[3] += glm::dvec4(offset, 0);
    from.tool.position_mm += offset;
    to.tool.position_mm += offset;
    add_samples(far, Sweep(tool, grid, from, to), grid, glm::uvec3(0), glm::uvec3(32));
    EXPECT_FALSE(here.empty());
    EXPECT_EQ(here.rows, far.rows);
}

} // namespace
} // namespace palpate
