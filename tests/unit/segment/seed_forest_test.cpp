#include "engine/segment/seed_forest.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "engine/segment/edges.h"
#include "engine/volume/builder.h"

namespace palpate::seed_forest_test {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Even and uneven spacing, several tiles; one so uneven that steps along z outdo most edges.
const Grid kGrids[] = {make_grid({37, 34, 12}, {1, 1, 1}), make_grid({40, 33, 9}, {0.5, 0.7, 3.0}),
                       make_grid({70, 1, 3}, {1, 2, 400})};

size_t number(const Grid& grid, glm::uvec3 i) {
    return i.x + grid.size.x * (i.y + size_t{grid.size.y} * i.z);
}

Volume volume_of(const Grid& grid, ScalarType type, const std::vector<double>& values) {
    return make_volume(grid, type, [&](glm::uvec3 i) { return values[number(grid, i)]; });
}

// Few distinct values, so that many paths cost the same.
Volume random_volume(const Grid& grid, ScalarType type, std::mt19937& random) {
    std::vector<double> values(sample_count(grid));
    for (double& value : values)
        value = type == ScalarType::f32 && random() % 12 == 0 ? kNone : double(random() % 4);
    return volume_of(grid, type, values);
}

using Seeds = std::vector<double>; // a label for each sample

Volume map_of(const Grid& grid, const Seeds& seeds) {
    return volume_of(grid, ScalarType::u8, seeds);
}

SeedForest forest_of(const Volume& volume, double highest_mm) {
    return {volume.grid(), *grow_heights(volume, nullptr, {}), highest_mm};
}

// The same costs in units of 1/16 of the smallest spacing, relaxed over all pairs of neighbours
// until none changes (Bellman & Ford), and then the least label over all steps that a cost is from.
struct Twin {
    std::vector<uint64_t> cost;
    std::vector<int> label;
};
Twin twin_of(const Grid& grid, const std::vector<uint16_t>& heights, const Seeds& seeds,
             double highest_mm) {
    constexpr auto kNever = std::numeric_limits<uint64_t>::max();
    const glm::dvec3 spacing = spacing_mm(grid);
    const double unit = std::min({spacing.x, spacing.y, spacing.z}) / 16.0;
    const auto highest = uint64_t(std::round(highest_mm / unit));
    const glm::uvec3 size = grid.size;
    Twin twin{std::vector<uint64_t>(seeds.size(), kNever), std::vector<int>(seeds.size())};
    for (size_t n = 0; n < seeds.size(); ++n)
        if (seeds[n] > 0 && heights[n] != kGrowWall)
            twin.cost[n] = 0, twin.label[n] = int(seeds[n]);
    const auto sweep = [&](const auto& relax) {
        bool changed = false;
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    for (int axis = 0; axis < 3; ++axis) {
                        const glm::uvec3 a(x, y, z);
                        glm::uvec3 b = a;
                        if (++b[axis] == size[axis])
                            continue;
                        const size_t m = number(grid, a), n = number(grid, b);
                        const auto h = uint64_t(std::round(spacing[axis] / unit));
                        for (const auto& [from, to] : {std::pair(m, n), std::pair(n, m)}) {
                            if (twin.cost[from] == kNever || heights[to] == kGrowWall)
                                continue;
                            const uint64_t height = heights[to] * highest / 65536;
                            changed |= relax(from, to, std::max(twin.cost[from], height) + h);
                        }
                    }
        return changed;
    };
    while (sweep([&](size_t, size_t to, uint64_t cost) {
        const bool is_less = cost < twin.cost[to];
        twin.cost[to] = std::min(cost, twin.cost[to]);
        return is_less;
    })) {
    }
    while (sweep([&](size_t from, size_t to, uint64_t cost) {
        if (cost != twin.cost[to] || twin.label[from] == 0 ||
            (twin.label[to] != 0 && twin.label[to] <= twin.label[from]))
            return false;
        twin.label[to] = twin.label[from];
        return true;
    })) {
    }
    return twin;
}

void expect_equal(const SeedForest& forest, const Grid& grid, const Twin& twin) {
    const Volume labels = *forest.labels(ScalarType::u8, 0, {});
    const Volume costs = *forest.costs({});
    const glm::dvec3 spacing = spacing_mm(grid);
    const double unit = std::min({spacing.x, spacing.y, spacing.z}) / 16.0;
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x) {
                const size_t n = number(grid, {x, y, z});
                ASSERT_EQ(labels.value({x, y, z}), float(twin.label[n]))
                    << x << " " << y << " " << z;
                if (twin.label[n] == 0)
                    ASSERT_TRUE(std::isnan(costs.value({x, y, z})));
                else
                    ASSERT_EQ(costs.value({x, y, z}), float(double(twin.cost[n]) * unit));
            }
}

Seeds random_seeds(const Grid& grid, std::mt19937& random, uint32_t count) {
    Seeds seeds(sample_count(grid));
    for (uint32_t n = 0; n < count; ++n)
        seeds[random() % seeds.size()] = 1 + random() % 4;
    return seeds;
}

TEST(SeedForest, IsTheForestOfBruteForce) {
    std::mt19937 random(11);
    for (const Grid& grid : kGrids)
        for (const ScalarType type : {ScalarType::i16, ScalarType::f32})
            for (const double highest_mm : {1.0, 40.0, 1e5}) {
                const Volume volume = random_volume(grid, type, random);
                const Seeds seeds = random_seeds(grid, random, 8);
                SeedForest forest = forest_of(volume, highest_mm);
                ASSERT_TRUE(forest.update(map_of(grid, seeds), {}));
                expect_equal(forest, grid,
                             twin_of(grid, *grow_heights(volume, nullptr, {}), seeds, highest_mm));
            }
}

void expect_same(const SeedForest& a, const SeedForest& b, const Grid& grid) {
    const Volume la = *a.labels(ScalarType::u8, 0, {}), lb = *b.labels(ScalarType::u8, 0, {});
    const Volume ca = *a.costs({}), cb = *b.costs({});
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x) {
                ASSERT_EQ(la.value({x, y, z}), lb.value({x, y, z}));
                const float m = ca.value({x, y, z}), n = cb.value({x, y, z});
                ASSERT_TRUE(m == n || (std::isnan(m) && std::isnan(n))) << m << " and " << n;
            }
}

TEST(SeedForest, UpdateIsAFreshForestToTheBit) {
    std::mt19937 random(12);
    for (const Grid& grid : kGrids)
        for (const double highest_mm : {1.0, 40.0, 1e5}) {
            const Volume volume = random_volume(grid, ScalarType::f32, random);
            Seeds seeds = random_seeds(grid, random, 6);
            SeedForest forest = forest_of(volume, highest_mm);
            for (int edit = 0; edit < 12; ++edit) {
                ASSERT_TRUE(forest.update(map_of(grid, seeds), {}));
                SeedForest fresh = forest_of(volume, highest_mm);
                ASSERT_TRUE(fresh.update(map_of(grid, seeds), {}));
                expect_same(forest, fresh, grid);
                // Some seeds come, some go, some change their label.
                for (double& seed : seeds)
                    if (seed > 0 && random() % 3 == 0)
                        seed = double(random() % 5);
                for (int n = 0; n < 2; ++n)
                    seeds[random() % seeds.size()] = 1 + random() % 4;
            }
        }
}

TEST(SeedForest, IsTheSameForAnyNumberOfThreads) {
    std::mt19937 random(13);
    const Grid grid = make_grid({80, 70, 40}, {1, 1, 2});
    const Volume volume = random_volume(grid, ScalarType::i16, random);
    const Seeds first = random_seeds(grid, random, 20), second = random_seeds(grid, random, 20);
    const auto made = [&](size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        SeedForest forest = forest_of(volume, 40.0);
        EXPECT_TRUE(forest.update(map_of(grid, first), {}));
        EXPECT_TRUE(forest.update(map_of(grid, second), {}));
        return forest;
    };
    const SeedForest one = made(1);
    expect_same(one, made(2), grid);
    expect_same(one, made(4), grid);
}

TEST(SeedForest, ASmallEditServesASmallPart) {
    const Grid grid = make_grid({64, 64, 64}, {1, 1, 1});
    const Volume volume =
        make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return i.x < 32 ? 0.0 : 100.0; });
    Seeds seeds(sample_count(grid));
    seeds[number(grid, {10, 32, 32})] = 1, seeds[number(grid, {50, 32, 32})] = 2;
    SeedForest forest = forest_of(volume, 1000.0);
    ASSERT_TRUE(forest.update(map_of(grid, seeds), {}));
    EXPECT_GE(forest.served(), sample_count(grid));
    ASSERT_TRUE(forest.update(map_of(grid, seeds), {}));
    EXPECT_EQ(forest.served(), 0u);
    // In a corner: it takes what is nearer to it, which is less than an eighth.
    seeds[number(grid, {63, 63, 63})] = 3;
    ASSERT_TRUE(forest.update(map_of(grid, seeds), {}));
    EXPECT_GT(forest.served(), 0u);
    EXPECT_LT(forest.served(), sample_count(grid) / 8);
}

TEST(SeedForest, PathsStayInARegion) {
    const Grid grid = make_grid({20, 3, 1}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 1.0; });
    const Volume region =
        make_volume(grid, ScalarType::u8, [](glm::uvec3 i) { return i.x == 10 ? 0.0 : 1.0; });
    Seeds seeds(sample_count(grid));
    seeds[number(grid, {0, 1, 0})] = 7;
    SeedForest forest(grid, *grow_heights(volume, &region, {}), 100.0);
    ASSERT_TRUE(forest.update(map_of(grid, seeds), {}));
    const Volume labels = *forest.labels(ScalarType::u8, 0, {});
    for (uint32_t x = 0; x < 20; ++x)
        EXPECT_EQ(labels.value({x, 2, 0}), x < 10 ? 7.0f : 0.0f);
    EXPECT_EQ(forest.labels(ScalarType::u8, 7, {})->range().max, 0.0f);
}

TEST(SeedForest, StopIsHeededAndTheNextUpdateIsWhole) {
    std::mt19937 random(14);
    const Grid grid = make_grid({40, 40, 40}, {1, 1, 1});
    const Volume volume = random_volume(grid, ScalarType::i16, random);
    const Volume seeds = map_of(grid, random_seeds(grid, random, 5));
    SeedForest forest = forest_of(volume, 40.0), fresh = forest_of(volume, 40.0);
    std::stop_source source;
    const Task task{source.get_token(), [&](double share) {
                        if (share > 0.0) // some samples have their costs
                            source.request_stop();
                    }};
    EXPECT_FALSE(forest.update(seeds, task));
    ASSERT_TRUE(forest.update(seeds, {}));
    ASSERT_TRUE(fresh.update(seeds, {}));
    expect_same(forest, fresh, grid);
}

TEST(SeedForest, TooManyLabelsAreRefused) {
    const Grid grid = make_grid({300, 1, 1}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 1.0; });
    const Volume seeds =
        make_volume(grid, ScalarType::u16, [](glm::uvec3 i) { return double(i.x + 1); });
    SeedForest forest = forest_of(volume, 40.0);
    EXPECT_FALSE(forest.update(seeds, {}));
}

// 200 labels go and 200 others come: a forest that is kept takes what a fresh one does.
TEST(SeedForest, LabelsThatHaveGoneDoNotCount) {
    const Grid grid = make_grid({200, 1, 1}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 1.0; });
    SeedForest forest = forest_of(volume, 40.0), fresh = forest_of(volume, 40.0);
    for (const uint32_t from : {1u, 301u}) {
        const Volume seeds =
            make_volume(grid, ScalarType::u16, [&](glm::uvec3 i) { return double(i.x + from); });
        ASSERT_TRUE(forest.update(seeds, {}));
        if (from > 1) {
            ASSERT_TRUE(fresh.update(seeds, {}));
        }
    }
    expect_same(forest, fresh, grid);
}

TEST(GrowHeights, AreTheShareOfSmallerGradients) {
    const Grid grid = make_grid({9, 8, 7}, {1, 2, 1});
    std::mt19937 random(15);
    const Volume volume = random_volume(grid, ScalarType::f32, random);
    const std::vector<uint16_t> heights = *grow_heights(volume, nullptr, {});
    const Volume edges = *edge_strength(volume, {});
    std::vector<float> all;
    for (size_t n = 0; n < heights.size(); ++n)
        all.push_back(edges.value({n % 9, n / 9 % 8, n / 72}));
    const auto count = std::ranges::count_if(all, [](float e) { return !std::isnan(e); });
    for (size_t n = 0; n < heights.size(); ++n) {
        if (std::isnan(all[n])) {
            EXPECT_EQ(heights[n], kGrowWall);
            continue;
        }
        // Those within a bin, 1/128 of a value, may count as equal.
        const auto below = [&](float e) {
            return double(std::ranges::count_if(all, [&](float x) { return x < e; })) * 65534.0 /
                   double(count);
        };
        EXPECT_LE(heights[n], below(all[n]));
        EXPECT_GE(heights[n], std::floor(below(all[n] * (1.0f - 1.0f / 128.0f))));
    }
}

} // namespace
} // namespace palpate::seed_forest_test
