#include "engine/segment/flood.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "engine/segment/fuzzy_connectedness.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct Seed {
    glm::uvec3 at;
    int label;
};

Volume seeds_at(const Grid& grid, std::initializer_list<Seed> seeds) {
    VolumeEdit edit(VolumeBuilder(grid, ScalarType::u8).finish());
    for (const Seed& seed : seeds)
        edit.set(seed.at, seed.label);
    return edit.commit();
}

Volume random_volume(const Grid& grid, ScalarType type, uint32_t seed, bool holes) {
    std::mt19937 random(seed);
    std::vector<double> values(sample_count(grid));
    for (double& value : values)
        value = holes && random() % 12 == 0 ? kNone : double(random() % 100);
    return make_volume(grid, type, [&](glm::uvec3 i) {
        return values[i.x + grid.size.x * (i.y + size_t{grid.size.y} * i.z)];
    });
}

std::vector<glm::uvec3> indices(const Grid& grid) {
    std::vector<glm::uvec3> all;
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x)
                all.emplace_back(x, y, z);
    return all;
}

size_t number(const Grid& grid, glm::uvec3 i) {
    return i.x + grid.size.x * (i.y + size_t{grid.size.y} * i.z);
}

bool are_neighbors(glm::uvec3 a, glm::uvec3 b, Neighbors neighbors) {
    const glm::ivec3 d = glm::abs(glm::ivec3(a) - glm::ivec3(b));
    const int count = d.x + d.y + d.z;
    return std::max({d.x, d.y, d.z}) == 1 && count <= (neighbors == Neighbors::face_6    ? 1
                                                       : neighbors == Neighbors::edge_18 ? 2
                                                                                         : 3);
}

// Every pair of neighbouring samples, in the order of their numbers.
template <class Visit>
void for_each_pair(const Grid& grid, Neighbors neighbors, Visit&& visit) {
    for (const glm::uvec3 a : indices(grid))
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const glm::uvec3 b = a + glm::uvec3(uint32_t(x), uint32_t(y), uint32_t(z));
                    if (glm::all(glm::lessThan(b, grid.size)) &&
                        number(grid, a) < number(grid, b) && are_neighbors(a, b, neighbors))
                        visit(a, b);
                }
}

const Grid kGrids[] = {make_grid({37, 35, 4}, {1, 1, 3}), make_grid({1, 40, 20}, {1, 2, 3}),
                       make_grid({70, 1, 1}, {1, 1, 1})};

TEST(RegionGrowing, IsThePartOfTheIntervalThatJoinsTheSeed) {
    for (const Grid& grid : kGrids)
        for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32})
            for (const Neighbors neighbors :
                 {Neighbors::face_6, Neighbors::edge_18, Neighbors::corner_26}) {
                const Volume volume = random_volume(grid, type, 3, type == ScalarType::f32);
                const glm::uvec3 seed = grid.size / 2u;
                const Volume seeds = seeds_at(grid, {{seed, 3}});
                const LabelInterval interval[] = {{3, {25.0, 99.0}}};
                const Result<Volume> grown = region_growing(volume, seeds, interval, neighbors, {});
                ASSERT_TRUE(grown) << grown.error().message;
                // Marks spread over all pairs of neighbours until nothing changes.
                std::vector<bool> in(sample_count(grid)), reached(in.size());
                for (const glm::uvec3 i : indices(grid))
                    in[number(grid, i)] = volume.value(i) >= 25.0f;
                reached[number(grid, seed)] = in[number(grid, seed)];
                for (bool changed = true; changed;) {
                    changed = false;
                    for_each_pair(grid, neighbors, [&](glm::uvec3 a, glm::uvec3 b) {
                        const size_t m = number(grid, a), n = number(grid, b);
                        if (in[m] && in[n] && reached[m] != reached[n])
                            reached[m] = reached[n] = changed = true;
                    });
                }
                for (const glm::uvec3 i : indices(grid))
                    ASSERT_EQ(grown->value(i), reached[number(grid, i)] ? 3.0f : 0.0f);
            }
}

TEST(RegionGrowing, LabelsMeetHalfway) {
    const Grid grid = make_grid({50, 3, 3}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 7.0; });
    const Volume seeds = seeds_at(grid, {{{0, 1, 1}, 1}, {{49, 1, 1}, 2}});
    const LabelInterval intervals[] = {{1, {7, 7}}, {2, {0, 9}}};
    const Result<Volume> grown = region_growing(volume, seeds, intervals, Neighbors::face_6, {});
    ASSERT_TRUE(grown);
    for (uint32_t x = 0; x < 50; ++x)
        EXPECT_EQ(grown->value({x, 1, 1}), x < 25 ? 1.0f : 2.0f) << x;
}

TEST(Watershed, EachSampleHasALabelThatReachesItOverItsLowestPass) {
    for (const Grid& grid : kGrids) {
        const Volume heights = random_volume(grid, ScalarType::f32, 5, true);
        const std::initializer_list<Seed> places = {
            {{0, 0, 0}, 1}, {grid.size - 1u, 2}, {grid.size / 2u, 3}};
        const Volume seeds = seeds_at(grid, places);
        const Result<Volume> flooded = watershed(heights, seeds, Neighbors::face_6, {});
        ASSERT_TRUE(flooded);
        // For each label alone the lowest pass to each sample, relaxed until nothing changes.
        std::vector<std::vector<float>> lowest;
        for (const Seed& seed : places) {
            std::vector<float>& h =
                lowest.emplace_back(sample_count(grid), std::numeric_limits<float>::infinity());
            if (!std::isnan(heights.value(seed.at)))
                h[number(grid, seed.at)] = heights.value(seed.at);
            for (bool changed = true; changed;) {
                changed = false;
                for_each_pair(grid, Neighbors::face_6, [&](glm::uvec3 a, glm::uvec3 b) {
                    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
                        const float there = heights.value(to);
                        const float way = std::max(h[number(grid, from)], there);
                        if (!std::isnan(there) && way < h[number(grid, to)]) {
                            h[number(grid, to)] = way;
                            changed = true;
                        }
                    }
                });
            }
        }
        for (const glm::uvec3 i : indices(grid)) {
            const size_t n = number(grid, i);
            const float least = std::min({lowest[0][n], lowest[1][n], lowest[2][n]});
            const auto label = size_t(flooded->value(i));
            if (std::isinf(least)) {
                EXPECT_EQ(label, 0u);
                continue;
            }
            ASSERT_GE(label, 1u);
            EXPECT_EQ(lowest[label - 1][n], least);
        }
    }
}

// Strengths along the maximum spanning tree: edges in falling order of affinity join trees, and the
// edge that joins a sample's tree to the seed's is its strength (Kruskal).
std::vector<double> spanning_tree(const Volume& volume, glm::uvec3 seed, const Affinity& of) {
    const Grid& grid = volume.grid();
    struct Edge {
        double affinity;
        size_t a, b;
    };
    std::vector<Edge> edges;
    for_each_pair(grid, Neighbors::face_6, [&](glm::uvec3 i, glm::uvec3 k) {
        const double a = volume.value(i), b = volume.value(k);
        if (std::isnan(a) || std::isnan(b))
            return;
        const double same = std::exp(-(a - b) * (a - b) / (2.0 * of.homogeneity * of.homogeneity));
        const double off = 0.5 * (a + b) - of.mean;
        const double object = std::exp(-off * off / (2.0 * of.sd * of.sd));
        edges.push_back(
            {of.weight * same + (1.0 - of.weight) * object, number(grid, i), number(grid, k)});
    });
    std::ranges::sort(edges, [](const Edge& a, const Edge& b) { return a.affinity > b.affinity; });
    std::vector<std::vector<size_t>> trees(sample_count(grid));
    std::vector<size_t> tree_of(trees.size());
    std::iota(tree_of.begin(), tree_of.end(), size_t{0});
    for (size_t n = 0; n < trees.size(); ++n)
        trees[n] = {n};
    std::vector<double> strength(trees.size(), -1.0);
    const size_t start = number(grid, seed);
    strength[start] = 1.0;
    for (const Edge& edge : edges) {
        size_t keep = tree_of[edge.a], gone = tree_of[edge.b];
        if (keep == gone)
            continue;
        for (const auto& [mine, other] : {std::pair(keep, gone), std::pair(gone, keep)})
            if (tree_of[start] == mine)
                for (const size_t n : trees[other])
                    strength[n] = edge.affinity;
        if (trees[keep].size() < trees[gone].size())
            std::swap(keep, gone);
        for (const size_t n : trees[gone])
            tree_of[n] = keep;
        trees[keep].insert(trees[keep].end(), trees[gone].begin(), trees[gone].end());
        trees[gone].clear();
    }
    return strength;
}

TEST(FuzzyConnectedness, IsTheWeakestEdgeOfTheMaximumSpanningTree) {
    for (const Grid& grid : kGrids) {
        const Volume volume = random_volume(grid, ScalarType::f32, 8, true);
        const glm::uvec3 seed = grid.size / 2u;
        if (std::isnan(volume.value(seed)))
            continue;
        const Affinity affinity{50.0, 20.0, 30.0, 0.4};
        const Result<Volume> found =
            fuzzy_connectedness(volume, seeds_at(grid, {{seed, 1}}), 1, affinity, {});
        ASSERT_TRUE(found) << found.error().message;
        const std::vector<double> expected = spanning_tree(volume, seed, affinity);
        size_t reached = 0;
        for (const glm::uvec3 i : indices(grid)) {
            const double strength = expected[number(grid, i)];
            if (strength < 0.0) {
                EXPECT_TRUE(std::isnan(found->value(i)));
                continue;
            }
            ++reached;
            EXPECT_NEAR(found->value(i), strength, 1e-5); // exp of float exponents up to 10
        }
        EXPECT_GT(reached, 1u);
    }
}

TEST(FuzzyConnectedness, IsTheSameBothWays) {
    const Grid& grid = kGrids[0];
    const Volume volume = random_volume(grid, ScalarType::i16, 9, false);
    const Affinity affinity{50.0, 20.0, 30.0, 0.4};
    const glm::uvec3 a(0, 0, 0), b(36, 34, 3);
    const auto from = [&](glm::uvec3 seed) {
        return *fuzzy_connectedness(volume, seeds_at(grid, {{seed, 1}}), 1, affinity, {});
    };
    EXPECT_EQ(from(a).value(b), from(b).value(a));
    EXPECT_EQ(from(a).value(a), 1.0f);
}

TEST(Flood, SeedsOnNoDataAreNoneAndStopIsHeeded) {
    const Grid grid = make_grid({40, 40, 40}, {1, 1, 1});
    const Volume hollow = make_volume(grid, ScalarType::f32, [](glm::uvec3) { return kNone; });
    const Volume seeds = seeds_at(grid, {{{1, 1, 1}, 1}});
    const Result<Volume> flooded = watershed(hollow, seeds, Neighbors::face_6, {});
    ASSERT_TRUE(flooded);
    EXPECT_EQ(flooded->range().max, 0.0f);
    std::stop_source source;
    source.request_stop();
    const Volume flat = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 1.0; });
    EXPECT_FALSE(watershed(flat, seeds, Neighbors::face_6, {source.get_token(), {}}));
}

} // namespace
} // namespace palpate
