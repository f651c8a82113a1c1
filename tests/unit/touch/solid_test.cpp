#include "bench/touch/solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bench/touch/open_loop.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

dvec3 any_point(std::mt19937_64& random, double reach) {
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
    return reach * dvec3(unit(), unit(), unit());
}

std::vector<TouchCase> all_cases() {
    return touch_cases({}, true);
}

// The distance is a distance: it never changes faster than its argument. (The gyroid's is one to
// first order only.)
TEST(Solid, DistanceChangesNoFasterThanPosition) {
    std::mt19937_64 random(1);
    for (const TouchCase& body : all_cases()) {
        if (body.name == "gyroid")
            continue;
        for (int i = 0; i < 300; ++i) {
            const dvec3 a = any_point(random, 5.0), b = a + any_point(random, 0.5);
            ASSERT_LE(std::abs(body.solid.distance_mm(a) - body.solid.distance_mm(b)),
                      glm::distance(a, b) + 1e-9)
                << body.name;
        }
    }
}

// The touched point lies on the surface, and the normal points out.
TEST(Solid, TouchedPointIsOnTheSurface) {
    for (const TouchCase& body : all_cases()) {
        EXPECT_NEAR(body.solid.distance_mm(body.touch_mm), 0.0, 1e-6) << body.name;
        EXPECT_GT(body.solid.distance_mm(body.touch_mm + 0.5 * body.normal), 0.2) << body.name;
        EXPECT_LT(body.solid.distance_mm(body.touch_mm - 0.1 * body.normal), 0.0) << body.name;
        EXPECT_NEAR(glm::dot(body.normal, body.along), 0.0, 1e-9) << body.name;
    }
}

// The nearest free point is free, and no point of a fine search is both free and nearer.
TEST(Solid, NearestFreePointIsNearest) {
    std::mt19937_64 random(2);
    for (const TouchCase& body : all_cases()) {
        if (!body.solid.nearest_free || body.id == "A10")
            continue;
        int checked = 0;
        for (int i = 0; i < 4000 && checked < 30; ++i) {
            const dvec3 x = body.touch_mm + any_point(random, 3.0);
            const double depth = -body.solid.distance_mm(x);
            if (depth <= 0.0 || depth > body.deepest_mm)
                continue;
            const auto nearest = body.solid.nearest_free(x);
            if (!nearest)
                continue;
            ++checked;
            EXPECT_NEAR(body.solid.distance_mm(*nearest), 0.0, 1e-6) << body.name;
            const double reach = glm::distance(x, *nearest);
            for (int k = 0; k < 2000; ++k) {
                const dvec3 other = x + reach * 0.999 * glm::normalize(any_point(random, 1.0));
                ASSERT_LT(body.solid.distance_mm(other), 1e-3 * reach + 1e-6) << body.name;
            }
        }
        EXPECT_GE(checked, 5) << body.name;
    }
}

// A projection onto a convex set does not expand: the oracle of excess jumps.
TEST(Solid, NearestFreePointDoesNotExpandWhereFreeSpaceIsConvex) {
    std::mt19937_64 random(3);
    int convex = 0;
    for (const TouchCase& body : all_cases()) {
        if (!body.solid.free_is_convex)
            continue;
        ++convex;
        for (int i = 0; i < 500; ++i) {
            const dvec3 a = body.touch_mm + any_point(random, 4.0), b = a + any_point(random, 0.3);
            const dvec3 pa = *body.solid.nearest_free(a), pb = *body.solid.nearest_free(b);
            ASSERT_LE(glm::distance(pa, pb), glm::distance(a, b) + 1e-9) << body.name;
            // and neither does the force: x - P(x) is a projection's complement
            ASSERT_LE(glm::distance(a - pa, b - pb), glm::distance(a, b) + 1e-9) << body.name;
        }
    }
    EXPECT_GE(convex, 20);
}

// Brute force: the best of a fine grid of the cone.
TEST(Solid, ProjectionToAWedgeIsTheNearestOfAGrid) {
    std::mt19937_64 random(4);
    for (int trial = 0; trial < 40; ++trial) {
        std::vector<dvec3> n;
        for (int i = 0; i < 1 + trial % 3; ++i)
            n.push_back(glm::normalize(any_point(random, 1.0) + dvec3(0, 0, 1.3)));
        const dvec3 x = any_point(random, 1.0);
        const dvec3 p = project_to_wedge(x, {}, n);
        double best = INFINITY;
        constexpr int kSide = 40;
        for (int i = 0; i < kSide * kSide * kSide; ++i) {
            const dvec3 q = 3.0 * (dvec3(i % kSide, i / kSide % kSide, i / (kSide * kSide)) /
                                       (0.5 * (kSide - 1)) -
                                   1.0);
            bool inside = true;
            for (const dvec3& normal : n)
                inside = inside && glm::dot(normal, q) >= 0.0;
            if (inside)
                best = std::min(best, glm::distance(x, q));
        }
        for (const dvec3& normal : n)
            EXPECT_GE(glm::dot(normal, p), -1e-9);
        EXPECT_LE(glm::distance(x, p), best + 1e-9); // the grid is no nearer,
        EXPECT_GE(glm::distance(x, p), best - 0.15); // and within half its diagonal
    }
}

// The stored field has its iso-surface where the distance is 0.
TEST(TouchScene, StoredSurfaceLiesWhereTheBodySays) {
    for (const TouchCase& body : all_cases())
        EXPECT_NEAR(body.solid.density(body.touch_mm, edge_mm({})), 0.5, 1e-6) << body.name;
}

// The true projection, instead of an algorithm.
TEST(Judge, FindsNothingWrongWithTheTruth) {
    for (const TouchCase& body : touch_cases({}, false)) {
        if (!body.solid.nearest_free || body.noise > 0.0)
            continue;
        const Scene scene{.body = body};
        for (const Trajectory& trajectory : trajectories(body, 3000, 1, false)) {
            Judge judge(scene, 1000.0, trajectory.judge_jumps);
            dvec3 last = trajectory.path.front();
            for (const dvec3 x : trajectory.path) {
                const auto p = body.solid.nearest_free(x);
                if (body.solid.part || !p || glm::distance(x, *p) > body.deepest_mm)
                    continue;
                // A body that is not convex has jumps where the nearest face changes.
                if (!body.solid.free_is_convex && glm::distance(x, last) > 0.1)
                    continue;
                last = x;
                haptics::TickOutput output;
                output.proxy.position_mm = *p;
                output.force_n = *p - x;
                judge.see(x, output);
            }
            const Figures& f = judge.figures();
            EXPECT_EQ(f.pop_throughs, 0u) << body.name << " " << trajectory.name;
            EXPECT_LE(f.penetration_voxels, 1e-5) << body.name << " " << trajectory.name;
            EXPECT_LE(f.direction_deg.max(), 1e-4) << body.name << " " << trajectory.name;
            if (body.solid.free_is_convex) {
                EXPECT_LE(f.excess_jump_n, 1e-9) << body.name << " " << trajectory.name;
            }
        }
    }
}

// The meter of energy: pressing a spring to depth d at speed v and out again, with the force held
// for a period T, generates k v T d, by summing an arithmetic series.
TEST(Judge, EnergyMeterReproducesTheHeldSpring) {
    const TouchCase body = touch_cases({}, false).front();
    for (const double speed : {20.0, 200.0}) {
        TouchCase flat = body;
        flat.solid = plane({}, {0, 0, 1});
        flat.touch_mm = {};
        flat.normal = {0, 0, 1};
        const Scene scene{.body = flat};
        Judge judge(scene, 1000.0, true);
        constexpr double kDepth_mm = 5.0;
        // Whole steps, so that the deepest point is met and the surface is on a step.
        const double step = speed * kTick_s;
        const int steps = static_cast<int>(std::lround(kDepth_mm / step));
        for (int i = -10; i <= 2 * steps + 10; ++i) {
            const dvec3 x(0, 0, -step * (i <= steps ? i : 2 * steps - i));
            haptics::TickOutput output;
            output.proxy.position_mm = *flat.solid.nearest_free(x);
            output.force_n = *flat.solid.nearest_free(x) - x;
            judge.see(x, output);
        }
        // k = 1 N/mm; N mm is mJ
        const double expected = 1.0 * speed * kTick_s * kDepth_mm;
        EXPECT_NEAR(judge.figures().energy_mj, expected, 1e-3 * expected);
    }
}

TEST(Histogram, PercentileIsTheUpperEdgeOfItsBin) {
    Histogram histogram(0.5);
    for (int i = 0; i < 100; ++i)
        histogram.add(0.1 * i); // 0 .. 9.9
    EXPECT_DOUBLE_EQ(histogram.percentile(0.5), 5.0);
    EXPECT_DOUBLE_EQ(histogram.percentile(1.0), 9.9);
    EXPECT_EQ(histogram.count(), 100u);
}

TEST(Histogram, OfTwoIsThatOfAllTheirValues) {
    Histogram one(0.05), other(0.05), all(0.05);
    for (int i = 0; i < 3000; ++i) {
        const double value = 0.0371 * i; // beyond the last bin, too
        (i % 3 ? one : other).add(value);
        all.add(value);
    }
    one.add(other);
    EXPECT_EQ(one.count(), all.count());
    EXPECT_EQ(one.max(), all.max());
    for (const double share : {0.0, 0.5, 0.9, 0.99, 1.0})
        EXPECT_EQ(one.percentile(share), all.percentile(share)) << share;
}

} // namespace
} // namespace palpate::touch
