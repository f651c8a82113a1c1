#include "engine/render/occupancy.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace palpate {
namespace {

// The distance by its definition: the nearest occupied cell on the longest axis.
std::vector<uint8_t> by_definition(const std::vector<uint8_t>& occupied, glm::ivec3 count) {
    std::vector<uint8_t> distances(occupied.size(), kMaxCellDistance);
    const auto at = [&](glm::ivec3 c) { return c.x + count.x * (c.y + count.y * c.z); };
    for (int z = 0; z < count.z; ++z)
        for (int y = 0; y < count.y; ++y)
            for (int x = 0; x < count.x; ++x)
                for (int k = 0; k < count.z; ++k)
                    for (int j = 0; j < count.y; ++j)
                        for (int i = 0; i < count.x; ++i)
                            if (occupied[at({i, j, k})]) {
                                const int d =
                                    std::max({std::abs(i - x), std::abs(j - y), std::abs(k - z)});
                                uint8_t& least = distances[at({x, y, z})];
                                least = static_cast<uint8_t>(std::min<int>(least, d));
                            }
    return distances;
}

TEST(Occupancy, DistancesAreThoseToTheNearestOccupiedCell) {
    std::mt19937 random(7);
    for (const glm::uvec3 count :
         {glm::uvec3(1), {17, 9, 5}, {40, 3, 2}, {2, 40, 3}, {3, 2, 40}, {70, 1, 1}, {12, 12, 12}})
        for (const double share : {0.0, 0.002, 0.02, 0.3, 1.0}) {
            std::bernoulli_distribution occupied(share);
            std::vector<uint8_t> cells(size_t{count.x} * count.y * count.z);
            for (uint8_t& cell : cells)
                cell = occupied(random);
            const std::vector<uint8_t> expected = by_definition(cells, glm::ivec3(count));
            chebyshev_distances(cells, count);
            EXPECT_EQ(cells, expected) << count.x << " x " << count.y << " x " << count.z;
        }
}

TEST(Occupancy, ATransferFunctionIsSeenWhereAnyValueBetweenHasOpacity) {
    TransferFunction narrow;
    narrow.colors = {{0.0, glm::dvec3(1.0)}};
    narrow.opacities = {{-1000, 0}, {99, 0}, {100, 0.5}, {101, 0}, {3000, 0}};
    const VisibleValues visible(make_table(narrow));
    EXPECT_TRUE(visible.any(-500, 500));
    EXPECT_TRUE(visible.any(100, 100));
    EXPECT_TRUE(visible.any(-500, 99.9));
    EXPECT_TRUE(visible.any(100.1, 4000));
    EXPECT_FALSE(visible.any(-2000, 90));
    EXPECT_FALSE(visible.any(110, 5000));
    EXPECT_FALSE(visible.any(-3000, -2000)); // the end entries serve what lies beyond

    TransferFunction high = window_function(0, 100, 0.1); // beyond 100 as at 100
    const VisibleValues above(make_table(high));
    EXPECT_TRUE(above.any(5000, 6000));
    EXPECT_FALSE(above.any(-6000, -5000));
}

TEST(Occupancy, AnIsoValueIsSeenWhereItIsReachedFromBelow) {
    const std::array<double, 2> isos{300.0, 700.0};
    const VisibleValues visible(isos);
    EXPECT_TRUE(visible.any(299, 301));
    EXPECT_TRUE(visible.any(299, 300));  // 300 counts as inside
    EXPECT_FALSE(visible.any(300, 500)); // all of it inside
    EXPECT_FALSE(visible.any(0, 299));
    EXPECT_TRUE(visible.any(500, 900));
    EXPECT_FALSE(visible.any(701, 900));
}

} // namespace
} // namespace palpate
