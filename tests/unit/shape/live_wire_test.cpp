#include "engine/segment/live_wire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <queue>
#include <random>

#include "engine/volume/synthetic.h"
#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

LiveWireRegion random_region(glm::uvec3 size, glm::dvec3 spacing, int least, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<int> cost(least, 255);
    LiveWireRegion out{{0, 0, 0}, size, glm::dmat3(1.0), {}};
    for (int axis = 0; axis < 3; ++axis)
        out.mm_from_step[axis][axis] = spacing[axis];
    for (size_t i = 0; i < size_t{size.x} * size.y * size.z; ++i)
        out.cost.push_back(uint8_t(cost(random)));
    return out;
}

// Bellman and Ford: relaxes every step until nothing changes.
std::vector<uint64_t> least_costs(const LiveWire& wire, glm::uvec3 anchor) {
    const LiveWireRegion& region = wire.region();
    const glm::ivec3 size(region.size);
    const auto number = [&](glm::ivec3 p) { return size_t(p.x + size.x * (p.y + size.y * p.z)); };
    std::vector<uint64_t> cost(region.cost.size(), UINT64_MAX / 2);
    cost[number(glm::ivec3(anchor))] = 0;
    for (bool changed = true; changed;) {
        changed = false;
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    for (const LiveWire::Step& step : wire.steps()) {
                        const glm::ivec3 q = glm::ivec3(x, y, z) + step.by;
                        if (glm::any(glm::lessThan(q, glm::ivec3(0))) ||
                            glm::any(glm::greaterThanEqual(q, size)))
                            continue;
                        const size_t a = number({x, y, z}), b = number(q);
                        const uint64_t by =
                            cost[a] + uint64_t{step.length} * (region.cost[a] + region.cost[b]);
                        if (by < cost[b]) {
                            cost[b] = by;
                            changed = true;
                        }
                    }
    }
    return cost;
}

uint64_t cost_along(const LiveWire& wire, const std::vector<glm::uvec3>& path) {
    const LiveWireRegion& region = wire.region();
    const auto cost = [&](glm::uvec3 p) {
        return uint64_t{region.cost[p.x + region.size.x * (p.y + size_t{region.size.y} * p.z)]};
    };
    uint64_t sum = 0;
    for (size_t i = 1; i < path.size(); ++i)
        for (const LiveWire::Step& step : wire.steps())
            if (step.by == glm::ivec3(path[i]) - glm::ivec3(path[i - 1]))
                sum += step.length * (cost(path[i]) + cost(path[i - 1]));
    return sum;
}

// Back from `to`, by the first step to a sample through which a way of least cost leads.
std::vector<glm::uvec3> first_path(const LiveWire& wire, const std::vector<uint64_t>& costs,
                                   glm::uvec3 to) {
    const glm::uvec3 n = wire.region().size;
    const auto number = [&](glm::uvec3 p) { return p.x + n.x * (p.y + size_t{n.y} * p.z); };
    std::vector<glm::uvec3> path{to};
    while (costs[number(path.back())] > 0)
        for (const LiveWire::Step& step : wire.steps()) {
            const glm::uvec3 from(glm::ivec3(path.back()) + step.by);
            if (glm::any(glm::greaterThanEqual(from, n)))
                continue;
            const std::vector<glm::uvec3> both{path.back(), from};
            if (costs[number(from)] + cost_along(wire, both) == costs[number(path.back())]) {
                path.push_back(from);
                break;
            }
        }
    std::reverse(path.begin(), path.end());
    return path;
}

TEST(LiveWire, CostsWhatBruteForceFindsFromEveryAnchor) {
    uint64_t seed = 1;
    for (const glm::uvec3 size : {glm::uvec3(24, 17, 1), {1, 30, 9}, {9, 8, 7}, {40, 1, 1}})
        for (const int least : {1, 60, 255}) {
            LiveWire wire(random_region(size, {0.5, 0.7, 3.0}, least, seed++));
            for (const glm::uvec3 anchor : {glm::uvec3(0), size / 2u, size - 1u}) {
                wire.set_anchor(anchor);
                const std::vector<uint64_t> expected = least_costs(wire, anchor);
                for (size_t i = 0; i < expected.size(); i += 3) {
                    const glm::uvec3 to = index_of(size, i);
                    const std::vector<glm::uvec3> path = wire.path(to);
                    ASSERT_EQ(path.front(), anchor);
                    ASSERT_EQ(path.back(), to);
                    ASSERT_EQ(wire.cost_of(to), expected[i]);
                    ASSERT_EQ(cost_along(wire, path), expected[i]);
                    ASSERT_EQ(path, first_path(wire, expected, to));
                }
            }
        }
}

TEST(LiveWire, APathDoesNotDependOnThoseAskedBefore) {
    const glm::uvec3 size(30, 30, 4);
    LiveWire kept(random_region(size, {1, 1, 2}, 250, 3)); // many ties
    kept.set_anchor({3, 4, 1});
    for (const glm::uvec3 to :
         {glm::uvec3(29, 29, 3), {0, 0, 0}, {20, 3, 2}, {3, 4, 1}, {28, 1, 0}}) {
        LiveWire fresh(random_region(size, {1, 1, 2}, 250, 3));
        fresh.set_anchor({3, 4, 1});
        EXPECT_EQ(fresh.path(to), kept.path(to));
    }
}

TEST(LiveWire, FollowsTheRimOfADisk) {
    const Grid grid = make_grid({128, 128, 5}, {0.5, 0.5, 2.0}, {-32, -32, -4});
    const double radius = 20.0;
    const Volume disk = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        return 100.0 / (1.0 + std::exp(std::hypot(p.x, p.y) - radius)); // an edge of about 2 mm
    });
    const Result<LiveWireRegion> region = live_wire_region(disk, {0, 0, 2}, {128, 128, 1}, {}, {});
    ASSERT_TRUE(region) << region.error().message;
    LiveWire wire(*region);
    wire.set_anchor({104, 64, 0}); // (20, 0) mm
    const std::vector<glm::uvec3> path = wire.path({64, 104, 0});
    for (const glm::uvec3 p : path) {
        const glm::dvec3 mm = world_point(grid, glm::dvec3(p.x, p.y, 2));
        // The steepest samples are those within a diagonal of the rim.
        EXPECT_NEAR(std::hypot(mm.x, mm.y), radius, 0.5 * std::sqrt(2.0)) << p.x << ' ' << p.y;
    }
    EXPECT_GT(path.size(), 40u);
}

TEST(LiveWire, FollowsATubeThroughTheVolume) {
    const auto middle = [](double z) {
        return glm::dvec2(20 + 10 * std::sin(z / 8.0), 20 + 8 * std::cos(z / 10.0));
    };
    LiveWireRegion region{{0, 0, 0}, {40, 40, 40}, glm::dmat3(1.0), {}};
    for (size_t i = 0; i < 64000; ++i) {
        const glm::uvec3 p = index_of({40, 40, 40}, i);
        const double off = glm::length(glm::dvec2(p.x, p.y) - middle(double(p.z)));
        region.cost.push_back(off < 1.5 ? 5 : 200);
    }
    LiveWire wire(std::move(region));
    const glm::uvec3 from(glm::round(middle(0)), 0), to(glm::round(middle(39)), 39);
    wire.set_anchor(from);
    for (const glm::uvec3 p : wire.path(to))
        EXPECT_LT(glm::length(glm::dvec2(p.x, p.y) - middle(double(p.z))), 1.5);
}

TEST(LiveWire, CostsMostWhereThereIsNoDataAndRefusesBadBoxes) {
    std::vector<float> samples(12 * 12 * 3, 1.0f);
    samples[5 + 12 * (5 + 12)] = NAN;
    const Volume volume = make_volume<float>(make_grid({12, 12, 3}, {1, 1, 1}), samples);
    const Result<LiveWireRegion> region = live_wire_region(volume, {0, 0, 0}, {12, 12, 3}, {}, {});
    ASSERT_TRUE(region);
    EXPECT_EQ(region->cost[5 + 12 * (5 + 12)], 255);
    EXPECT_EQ(region->cost[6 + 12 * (5 + 12)], 255);
    EXPECT_FALSE(live_wire_region(volume, {0, 0, 0}, {13, 1, 1}, {}, {}));
    EXPECT_FALSE(live_wire_region(volume, {0, 0, 0}, {0, 1, 1}, {}, {}));
    EXPECT_FALSE(live_wire_region(volume, {0, 0, 0}, {2, 2, 2},
                                  {.gradient_weight = 0, .crossing_weight = 0}, {}));
}

} // namespace
} // namespace palpate
