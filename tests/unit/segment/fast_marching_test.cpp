#include "engine/segment/fast_marching.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

using testing::HasSubstr;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Grid cube(uint32_t n) {
    return make_grid(glm::uvec3(n), glm::dvec3(1.0 / (n - 1)));
}

Volume cost_of(const Grid& grid, const std::function<double(glm::dvec3 mm)>& cost) {
    return make_volume(grid, ScalarType::f32,
                       [&](glm::uvec3 i) { return cost(world_point(grid, glm::dvec3(i))); });
}

Volume constant(const Grid& grid) {
    return cost_of(grid, [](glm::dvec3) { return 1.0; });
}

Volume march(const Volume& cost, const MarchStart& start, FastMarchingOptions options = {}) {
    Result<Volume> made = fast_marching(cost, start, options, {});
    EXPECT_TRUE(made) << made.error().message;
    return *made;
}

struct Off {
    double max = 0.0, mean = 0.0;
};

Off off(const Volume& found, const std::function<double(glm::dvec3 mm)>& exact) {
    Off off;
    std::vector<float> row(found.size().x);
    for (uint32_t z = 0; z < found.size().z; ++z)
        for (uint32_t y = 0; y < found.size().y; ++y) {
            read_row(found, {0, y, z}, found.size().x, row.data());
            for (uint32_t x = 0; x < found.size().x; ++x) {
                const double by = std::abs(row[x] - exact(world_point(found.grid(), {x, y, z})));
                EXPECT_FALSE(std::isnan(by));
                off.max = std::max(off.max, by);
                off.mean += by;
            }
        }
    off.mean /= double(sample_count(found.grid()));
    return off;
}

const SeedBall kPoint[] = {{1, {0.5, 0.5, 0.5}, 0.0}};

// FastMarching takes over 5 s of a processor: an order of convergence shows on several resolutions
// alone, and a front passes every sample of each.

// A look on the way is what the front has passed: the samples that have arrived by some time, and
// never fewer than the look before.
TEST(FastMarching, ALookIsWhatTheFrontHasPassed) {
    const SeedBall ball[] = {{1, {0.3, 0.5, 0.6}, 0.0}};
    const Volume cost = cost_of(cube(40), [](glm::dvec3 p) { return 1.0 + p.x; });
    std::vector<Volume> looks;
    const Task task{{}, {}, [&](const std::function<Volume()>& make) { looks.push_back(make()); }};
    const Result<Volume> arrival = fast_marching(cost, {.balls = ball}, {}, task);
    ASSERT_TRUE(arrival);
    ASSERT_GE(looks.size(), 3u);
    size_t before = 0;
    for (const Volume& look : looks) {
        float last_inside = 0.0f, first_outside = std::numeric_limits<float>::infinity();
        size_t count = 0;
        for (uint32_t z = 0; z < 40; ++z)
            for (uint32_t y = 0; y < 40; ++y)
                for (uint32_t x = 0; x < 40; ++x) {
                    const float time = arrival->value({x, y, z});
                    const bool inside = look.value({x, y, z}) != 0.0f;
                    count += inside;
                    (inside ? last_inside : first_outside) =
                        inside ? std::max(last_inside, time) : std::min(first_outside, time);
                }
        EXPECT_LE(last_inside, first_outside);
        EXPECT_GE(count, before);
        before = count;
    }
    EXPECT_EQ(before, sample_count(cost.grid()));
    EXPECT_GT(looks.front().range().max, 0.0f);
}

// The mean error from a point at 65^3 and 129^3, and at 257^3 where `fine`; each halving of the
// step divides it by at least 2^1.8.
void expect_second_order(glm::dvec3 point, bool fine) {
    double before = 0.0;
    for (const uint32_t n : {65u, 129u, 257u}) {
        if (n == 257 && !fine)
            break;
        const SeedBall ball[] = {{1, point, 0.0}};
        const Volume found = march(constant(cube(n)), {.balls = ball});
        const Off error = off(found, [&](glm::dvec3 p) { return glm::length(p - point); });
        std::printf("mean error from a point at %u^3: %.3e\n", n, error.mean);
        if (before > 0.0) {
            EXPECT_GE(std::log2(before / error.mean), 1.8) << n;
        }
        before = error.mean;
    }
}

TEST(FastMarching, IsOfSecondOrderFromAPoint) {
    expect_second_order({0.5, 0.5, 0.5}, true);
}

TEST(FastMarching, IsOfSecondOrderFromAPointBetweenSamples) {
    expect_second_order({0.5031, 0.4977, 0.5012}, false);
}

TEST(FastMarching, IsExactInTheNearFieldOfAPoint) {
    // There the distance solves the factored equations, so that rounding alone remains. A time is a
    // sum of n / 2 roundings at most, each amplified by the extrapolation (4 a - b) / 3 at most
    // 5 / 3 times; times are below 0.25.
    const uint32_t n = 65;
    for (const glm::dvec3 point : {glm::dvec3(0.5), glm::dvec3(0.5031, 0.4977, 0.5012)}) {
        const SeedBall ball[] = {{1, point, 0.0}};
        const Volume found = march(constant(cube(n)), {.balls = ball});
        double worst = 0.0;
        for (uint32_t z = 0; z < n; ++z)
            for (uint32_t y = 0; y < n; ++y)
                for (uint32_t x = 0; x < n; ++x) {
                    const glm::uvec3 at(x, y, z);
                    const double exact =
                        glm::length(world_point(found.grid(), glm::dvec3(at)) - point);
                    if (exact < 0.23)
                        worst = std::max(worst, std::abs(found.value(at) - exact));
                }
        EXPECT_LE(worst, 5.0 / 3.0 * n / 2.0 * 0.25 * 0x1p-24);
    }
}

TEST(FastMarching, IsOfSecondOrderWhereSpeedIsLinear) {
    // Speed 1 + z: T = acosh(1 + d^2 / (2 F0 F)), with d the distance and F0, F the speeds at both
    // ends.
    const auto error = [](uint32_t n) {
        const Volume cost = cost_of(cube(n), [](glm::dvec3 p) { return 1.0 / (1.0 + p.z); });
        return off(march(cost, {.balls = kPoint}), [](glm::dvec3 p) {
            const glm::dvec3 d = p - glm::dvec3(0.5);
            return std::acosh(1.0 + glm::dot(d, d) / (2.0 * 1.5 * (1.0 + p.z)));
        });
    };
    const Off coarse = error(33), fine = error(129);
    EXPECT_GE(std::log2(coarse.mean / fine.mean) / 2.0, 1.8);
    EXPECT_LE(fine.max, 1e-3);
}

TEST(FastMarching, OfASphereIsWithinTheErrorThatIsAsked) {
    const SeedBall ball[] = {{1, {0.5, 0.5, 0.5}, 0.1}};
    const auto exact = [](glm::dvec3 p) {
        return std::max(0.0, glm::length(p - glm::dvec3(0.5)) - 0.1);
    };
    const Volume cost = constant(cube(129));
    const Off second = off(march(cost, {.balls = ball}), exact);
    const Off first = off(march(cost, {.balls = ball}, {.order = 1}), exact);
    std::printf("sphere at 129^3: second order %.2e max %.2e mean, first %.2e %.2e\n", second.max,
                second.mean, first.max, first.mean);
    EXPECT_LE(second.max, 1e-3);
    EXPECT_LE(second.mean, 2e-4);
    EXPECT_LE(first.max, 1.0e-2); // scikit-fmm's
}

TEST(FastMarching, TakesUnevenSpacingAndTurnedAxes) {
    Grid grid = make_grid({61, 61, 16}, {0.5, 0.5, 2.0}, {3, -4, 5});
    const glm::dvec3 center = world_point(grid, {30.25, 29.5, 7.75});
    const SeedBall point[] = {{1, center, 0.0}};
    const Volume plain = march(constant(grid), {.balls = point});
    const auto distance = [&](glm::dvec3 p) { return glm::length(p - center); };
    // Second order in the longest step, 2 mm, over about 30 mm: h^2 / R with R = 7.5 mm, the reach
    // of the near field.
    EXPECT_LE(off(plain, distance).max, 2.0 * 2.0 / 7.5);
    EXPECT_LE(off(plain, distance).mean, 0.1);
    const double c = std::cos(0.5), s = std::sin(0.5);
    glm::dmat4 turn(1.0);
    turn[0][0] = c, turn[0][1] = s, turn[1][0] = -s, turn[1][1] = c;
    Grid turned = grid;
    turned.world_from_index = turn * grid.world_from_index;
    const SeedBall there[] = {{1, glm::dvec3(turn * glm::dvec4(center, 1.0)), 0.0}};
    const Volume found = march(constant(turned), {.balls = there});
    for (uint32_t z = 0; z < 16; ++z)
        for (uint32_t x = 0; x < 61; ++x) // the matrices differ in their last bits
            EXPECT_NEAR(found.value({x, 17, z}), plain.value({x, 17, z}), 1e-4);
}

TEST(FastMarching, TwoSourcesMeetInAPlane) {
    const SeedBall two[] = {{1, {0.25, 0.5, 0.5}, 0.0}, {2, {0.75, 0.5, 0.5}, 0.0}};
    const auto exact = [&](glm::dvec3 p) {
        return std::min(glm::length(p - two[0].center_mm), glm::length(p - two[1].center_mm));
    };
    const Off coarse = off(march(constant(cube(33)), {.balls = two}), exact);
    const Off fine = off(march(constant(cube(65)), {.balls = two}), exact);
    EXPECT_LE(fine.max, 1.0 / 64); // of first order where they meet
    EXPECT_GE(std::log2(coarse.mean / fine.mean), 1.6);
}

TEST(FastMarching, BendsAtAWallBetweenTwoSpeeds) {
    // Fermat: the least of c1 |s - q| + c2 |q - p| over points q of the plane x = 0.5, which by
    // symmetry lie on the line between the feet of s and p.
    const glm::dvec3 source(0.25, 0.5, 0.5);
    const auto exact = [&](glm::dvec3 p) {
        if (p.x <= 0.5)
            return kNone; // head waves reach there too; not compared
        const double across = std::hypot(p.y - 0.5, p.z - 0.5);
        double low = 0.0, high = across;
        const auto time = [&](double q) {
            return std::hypot(0.25, q) + 3.0 * std::hypot(p.x - 0.5, across - q);
        };
        for (int i = 0; i < 100; ++i) {
            const double a = low + (high - low) / 3.0, b = high - (high - low) / 3.0;
            (time(a) < time(b) ? high : low) = time(a) < time(b) ? b : a;
        }
        return time(low);
    };
    const SeedBall point[] = {{1, source, 0.0}};
    const uint32_t n = 65;
    const Volume cost = cost_of(cube(n), [](glm::dvec3 p) { return p.x <= 0.5 ? 1.0 : 3.0; });
    const Volume found = march(cost, {.balls = point});
    double worst = 0.0;
    for (uint32_t z = 0; z < n; ++z)
        for (uint32_t y = 0; y < n; ++y)
            for (uint32_t x = n / 2 + 2; x < n; ++x)
                worst = std::max(worst, std::abs(found.value({x, y, z}) -
                                                 exact(world_point(cube(n), {x, y, z}))));
    EXPECT_LE(worst, 3.0 / 64); // where cost jumps, its place is known to a sample
}

// The upwind equations of first order, iterated on the whole grid until nothing changes; each
// solved by bisection.
std::vector<double> twin(const Volume& cost, const Volume& seeds) {
    const glm::uvec3 n = cost.size();
    const glm::dvec3 h = spacing_mm(cost.grid());
    const auto at = [&](glm::uvec3 i) { return i.x + n.x * (i.y + size_t{n.y} * i.z); };
    std::vector<double> u(size_t{n.x} * n.y * n.z, kNever);
    const auto update = [&](glm::uvec3 i) {
        const double c = cost.value(i);
        if (!std::isfinite(c))
            return 0.0;
        if (seeds.value(i) > 0.0f) {
            const double before = u[at(i)];
            u[at(i)] = 0.0;
            return before;
        }
        glm::dvec3 from(kNever);
        for (int k = 0; k < 3; ++k)
            for (const uint32_t step : {~0u, 1u}) {
                glm::uvec3 next = i;
                next[k] += step;
                if (next[k] < n[k])
                    from[k] = std::min(from[k], u[at(next)]);
            }
        const double least = std::min({from.x, from.y, from.z});
        if (least == kNever)
            return 0.0;
        double low = least, high = least + c * std::max({h.x, h.y, h.z});
        for (int step = 0; step < 60; ++step) {
            const double middle = 0.5 * (low + high);
            double sum = 0.0;
            for (int k = 0; k < 3; ++k)
                sum += std::pow(std::max(0.0, middle - from[k]) / h[k], 2);
            (sum < c * c ? low : high) = middle;
        }
        const double change = u[at(i)] - high;
        if (change > 0.0)
            u[at(i)] = high;
        return change;
    };
    for (double most = kNever; most > 1e-9;) {
        most = 0.0;
        for (size_t k = 0; k < 2 * u.size(); ++k) { // forth and back
            const size_t number = k < u.size() ? k : 2 * u.size() - 1 - k;
            most = std::max(
                most, update({number % n.x, number / n.x % n.y, number / (size_t{n.x} * n.y)}));
        }
    }
    return u;
}

Volume random_cost(const Grid& grid, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    std::vector<float> values(sample_count(grid));
    for (float& value : values) {
        const double kind = share(random);
        value = float(kind < 0.08   ? kNone // a wall
                      : kind < 0.12 ? 0.0
                      : kind < 0.5  ? 1.0
                                    : std::pow(10.0, 3.0 * share(random)));
    }
    return make_volume(grid, std::span<const float>(values));
}

Volume seeds_at(const Grid& grid, std::initializer_list<glm::uvec3> places) {
    VolumeEdit edit(VolumeBuilder(grid, ScalarType::u8).finish());
    for (const glm::uvec3 place : places)
        edit.set(place, 1.0);
    return edit.commit();
}

TEST(FastMarching, OfFirstOrderSolvesTheUpwindEquations) {
    for (const Grid& grid :
         {make_grid({35, 34, 4}, {1, 1, 1}), make_grid({9, 70, 3}, {0.5, 0.7, 3}),
          make_grid({1, 33, 34}, {2, 1, 1}), make_grid({40, 1, 1}, {1, 1, 1})}) {
        const Volume cost = random_cost(grid, grid.size.y);
        const Volume seeds = seeds_at(grid, {{0, 0, 0}, grid.size - 1u, grid.size / 2u});
        const std::vector<double> expected = twin(cost, seeds);
        const Volume found = march(cost, {.seeds = &seeds}, {.order = 1});
        size_t number = 0;
        for (uint32_t z = 0; z < grid.size.z; ++z)
            for (uint32_t y = 0; y < grid.size.y; ++y)
                for (uint32_t x = 0; x < grid.size.x; ++x, ++number) {
                    const float time = found.value({x, y, z});
                    if (expected[number] == kNever) {
                        EXPECT_TRUE(std::isnan(time)) << x << " " << y << " " << z;
                        continue;
                    }
                    // A time is a sum of at most 200 rounded ones.
                    EXPECT_NEAR(time, expected[number], 200 * 0x1p-24 * (1.0 + expected[number]))
                        << x << " " << y << " " << z;
                }
    }
}

TEST(FastMarching, FindsTheHoleInAWallAndTheWayThroughAMaze) {
    // Walls at x = 4, 8, 12, .. with one hole, at y = 0 and y = 39 in turn.
    const Grid grid = make_grid({40, 40, 3}, {1, 1, 1});
    const Volume cost = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        const bool is_wall = i.x % 4 == 0 && i.x > 0 && i.y != (i.x / 4 % 2 ? 0 : 39);
        return is_wall ? kNone : 1.0;
    });
    const Volume seeds = seeds_at(grid, {{0, 20, 1}});
    const std::vector<double> expected = twin(cost, seeds);
    const Volume found = march(cost, {.seeds = &seeds}, {.order = 1});
    EXPECT_NEAR(found.value({39, 20, 1}), expected[39 + 40 * (20 + 40)], 1e-3);
    EXPECT_GT(found.value({39, 20, 1}), 9 * 38.0); // to and fro
    const Volume second = march(cost, {.seeds = &seeds});
    EXPECT_GT(second.value({39, 20, 1}), 9 * 38.0);
    EXPECT_LT(second.value({39, 20, 1}), found.value({39, 20, 1}));
}

TEST(FastMarching, IsMonotoneAndCausal) {
    const Grid grid = make_grid({40, 36, 6}, {1, 1, 2});
    const Volume cost = random_cost(grid, 3);
    const Volume seeds = seeds_at(grid, {{20, 18, 3}});
    VolumeEdit edit(cost);
    std::mt19937 random(4);
    for (int i = 0; i < 500; ++i) {
        const glm::uvec3 at(random() % 40, random() % 36, random() % 6);
        edit.set(at, 2.0 * double(cost.value(at)));
    }
    const Volume dearer = edit.commit();
    for (const int order : {1, 2}) {
        const Volume before = march(cost, {.seeds = &seeds}, {.order = order});
        const Volume after = march(dearer, {.seeds = &seeds}, {.order = order});
        for (uint32_t z = 0; z < 6; ++z)
            for (uint32_t y = 0; y < 36; ++y)
                for (uint32_t x = 0; x < 40; ++x) {
                    const float time = before.value({x, y, z});
                    if (std::isnan(time) || glm::uvec3(x, y, z) == glm::uvec3(20, 18, 3))
                        continue;
                    if (order == 1) { // the scheme of second order is not monotone
                        EXPECT_GE(after.value({x, y, z}), time * (1.0f - 1e-5f));
                    }
                    float earliest = std::numeric_limits<float>::infinity();
                    for (int k = 0; k < 3; ++k)
                        for (const uint32_t step : {~0u, 1u}) {
                            glm::uvec3 next(x, y, z);
                            next[k] += step;
                            if (next[k] < grid.size[k] && !std::isnan(before.value(next)))
                                earliest = std::min(earliest, before.value(next));
                        }
                    EXPECT_LE(earliest, time) << x << " " << y << " " << z;
                }
    }
}

TEST(FastMarching, AnyNumberOfThreadsGivesTheSameBits) {
    const Grid grid = make_grid({100, 70, 66}, {1, 1, 1.5});
    std::mt19937 random(5);
    std::vector<float> values(sample_count(grid));
    for (float& value : values)
        value = float(1 + random() % 100);
    const Volume cost = make_volume(grid, std::span<const float>(values));
    const SeedBall balls[] = {{1, {20, 20, 20}, 5.0}, {1, {80, 50, 60}, 0.0}};
    for (const int order : {1, 2}) {
        std::vector<Volume> found;
        for (const size_t threads : {1u, 2u, 4u}) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            found.push_back(march(cost, {.balls = balls}, {.order = order}));
        }
        for_each_brick(found[0], [&](glm::uvec3 at) {
            EXPECT_EQ(differing_blocks(found[0].brick(at), found[1].brick(at)), 0u);
            EXPECT_EQ(differing_blocks(found[0].brick(at), found[2].brick(at)), 0u);
        });
    }
}

TEST(FastMarching, EndsAtTheLastTime) {
    const Grid grid = make_grid({60, 1, 1}, {2, 1, 1});
    const Volume seeds = seeds_at(grid, {{10, 0, 0}});
    const Volume found = march(constant(grid), {.seeds = &seeds}, {.last_time = 20.0f});
    for (uint32_t x = 0; x < 60; ++x) {
        const float expected = 2.0f * std::abs(float(x) - 10.0f);
        if (expected > 20.0f) {
            EXPECT_TRUE(std::isnan(found.value({x, 0, 0}))) << x;
            continue;
        }
        EXPECT_NEAR(found.value({x, 0, 0}), expected, 1e-5) << x;
    }
}

TEST(FastMarching, BadInputIsOneSentence) {
    const Grid grid = make_grid({8, 8, 8}, {1, 1, 1});
    const Volume seeds = seeds_at(grid, {{3, 3, 3}});
    const auto why = [&](const Volume& cost, const MarchStart& start) {
        const Result<Volume> made = fast_marching(cost, start, {}, {});
        return made ? "" : made.error().message;
    };
    EXPECT_THAT(why(seeds, {.seeds = &seeds}), HasSubstr("of type f32, found u8"));
    EXPECT_THAT(why(cost_of(grid, [](glm::dvec3 p) { return p.x - 1.0; }), {.seeds = &seeds}),
                HasSubstr("at least 0, found -1"));
    EXPECT_THAT(why(cost_of(grid, [](glm::dvec3 p) { return p.x == 3.0 ? kNone : 1.0; }),
                    {.seeds = &seeds}),
                HasSubstr("no seed lies where the cost is finite"));
    EXPECT_THAT(why(cost_of(grid, [](glm::dvec3) { return kNone; }), {.seeds = &seeds}),
                HasSubstr("no seed lies where"));
    EXPECT_THAT(why(constant(grid), {}), HasSubstr("no seed lies where"));
    Grid sheared = grid;
    sheared.world_from_index[1][0] = 0.2;
    EXPECT_THAT(why(constant(sheared), {.seeds = &seeds}), HasSubstr("sheared"));
    const Volume other = seeds_at(make_grid({8, 8, 9}, {1, 1, 1}), {{3, 3, 3}});
    EXPECT_THAT(why(constant(grid), {.seeds = &other}), HasSubstr("another size"));
    std::stop_source source;
    source.request_stop();
    EXPECT_EQ(fast_marching(constant(grid), {.seeds = &seeds}, {}, {source.get_token(), {}})
                  .error()
                  .message,
              "stopped before it was done");
}

} // namespace
} // namespace palpate
