#include "engine/segment/arrival_threshold.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>

#include "engine/segment/fast_marching.h"
#include "engine/volume/builder.h"

namespace palpate {
namespace {

// Arrival at a distance r from the middle: 1 unit a mm within radius_mm, `outside` beyond.
Volume ball_arrival(double radius_mm, double outside, double scale = 1.0,
                    glm::dvec3 spacing = {1, 1, 1}) {
    const glm::uvec3 size(glm::round(glm::dvec3(96.0) / spacing));
    const Grid grid = make_grid(size, spacing, -0.5 * spacing * glm::dvec3(size));
    return make_volume(grid, ScalarType::f32, [=](glm::uvec3 index) {
        const double r = glm::length(world_point(grid, glm::dvec3(index)));
        return scale * (std::min(r, radius_mm) + outside * std::max(r - radius_mm, 0.0)) -
               scale * 4.0;
    });
}

double count_within(const Volume& arrival, double time) {
    double count = 0.0;
    const glm::uvec3 n = arrival.size();
    for (uint32_t z = 0; z < n.z; ++z)
        for (uint32_t y = 0; y < n.y; ++y)
            for (uint32_t x = 0; x < n.x; ++x)
                count += arrival.value({x, y, z}) < time;
    return count;
}

TEST(ArrivalGrowth, CountsWhatHasArrived) {
    const Volume arrival = ball_arrival(20.0, 5.0);
    const Result<ArrivalGrowth> growth = arrival_growth(arrival, {});
    ASSERT_TRUE(growth);
    ASSERT_GT(growth->times.size(), 20u);
    for (size_t i = 0; i < growth->times.size(); i += 5)
        EXPECT_EQ(growth->counts[i], count_within(arrival, growth->times[i])) << i;
    EXPECT_NEAR(growth->times[9] / growth->times[1], 2.0, 1e-12);
    EXPECT_EQ(growth->counts.back(), 96.0 * 96.0 * 96.0);
}

// Cost and values of that ball: in it `cost` and 100, beyond it `outside` times as much and 0.
Volume in_ball(const Grid& grid, double radius_mm, double within, double beyond) {
    return make_volume(grid, ScalarType::f32, [=](glm::uvec3 index) {
        return glm::length(world_point(grid, glm::dvec3(index))) < radius_mm ? within : beyond;
    });
}
std::optional<double> time_of_ball(const Volume& arrival, double radius_mm, double outside,
                                   double scale) {
    const Volume cost = in_ball(arrival.grid(), radius_mm, scale, scale * outside);
    const Volume values = in_ball(arrival.grid(), radius_mm, 100.0, 0.0);
    const Result<std::optional<double>> time = boundary_time(arrival, cost, values, {});
    EXPECT_TRUE(time);
    return time ? *time : std::nullopt;
}

// A ball whose surroundings cost much more: any threshold from its radius on to where the front has
// come some way out bounds it; the rule finds one, for any scale of the cost and any spacing. The
// ball is found to the spacing of times, in which the front goes 1.0905 * 16 mm / 40.
TEST(BoundaryTime, FindsABallForAnyScaleAndSpacing) {
    for (const double scale : {1e-6, 0.37, 1.0, 5e8})
        for (const glm::dvec3 spacing : {glm::dvec3(1.0), glm::dvec3(0.7, 1.0, 3.0)}) {
            const Volume arrival = ball_arrival(20.0, 40.0, scale, spacing);
            const auto time = time_of_ball(arrival, 20.0, 40.0, scale);
            ASSERT_TRUE(time) << scale;
            // The outermost samples lie half a spacing within.
            EXPECT_GE(*time, scale * (16.0 - 0.5 * spacing.z));
            const double beyond_mm = (*time / scale - 16.0) / 40.0;
            EXPECT_LT(beyond_mm, 0.5) << scale;
        }
}

// The same front in a cost that is one everywhere; nothing that has arrived; seeds everywhere.
TEST(BoundaryTime, FindsNothingWhereThereIsNothing) {
    EXPECT_FALSE(time_of_ball(ball_arrival(500.0, 1.0), 500.0, 1.0, 1.0));
    EXPECT_FALSE(time_of_ball(ball_arrival(20.0, 1.0), 20.0, 1.0, 1.0));
    const Volume nothing = make_volume(make_grid({5, 5, 5}, {1, 1, 1}), ScalarType::f32, [](auto) {
        return std::numeric_limits<double>::quiet_NaN();
    });
    EXPECT_FALSE(time_of_ball(nothing, 2.0, 9.0, 1.0));
    const Volume seeds =
        make_volume(make_grid({5, 5, 5}, {1, 1, 1}), ScalarType::f32, [](auto) { return 0.0; });
    EXPECT_FALSE(time_of_ball(seeds, 2.0, 9.0, 1.0));
    EXPECT_FALSE(boundary_time(nothing, ball_arrival(20.0, 5.0), nothing, {}));
}

TEST(BandCostTime, StopsWhereTheFrontGetsDear) {
    const Volume arrival = ball_arrival(20.0, 5.0);
    const Grid& grid = arrival.grid();
    const Volume cost = make_volume(grid, ScalarType::f32, [&](glm::uvec3 index) {
        return glm::length(world_point(grid, glm::dvec3(index))) < 20.0 ? 1.0 : 5.0;
    });
    const auto time = band_cost_time(arrival, cost, 3.0, {});
    ASSERT_TRUE(time && *time);
    // The band that begins at the boundary's time, 16, or the one within which it lies.
    EXPECT_GE(**time, 16.0 / kGrowthRatio);
    EXPECT_LE(**time, 16.0 * kGrowthRatio);
    const auto never = band_cost_time(arrival, cost, 6.0, {});
    ASSERT_TRUE(never);
    EXPECT_FALSE(*never);
}

TEST(ArrivalGrowth, TheNumberOfThreadsChangesNothing) {
    const Volume arrival = ball_arrival(20.0, 5.0);
    std::vector<ArrivalGrowth> found;
    for (const size_t threads : {1, 2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        found.push_back(*arrival_growth(arrival, {}));
    }
    EXPECT_EQ(found[0].counts, found[1].counts);
    EXPECT_EQ(found[0].counts, found[2].counts);
}

TEST(ArrivalGrowth, Stops) {
    std::stop_source source;
    source.request_stop();
    EXPECT_FALSE(arrival_growth(ball_arrival(20.0, 5.0), {source.get_token(), {}}));
}

} // namespace
} // namespace palpate
