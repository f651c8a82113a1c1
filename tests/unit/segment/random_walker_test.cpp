#include "engine/segment/random_walker.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

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

TEST(RandomWalker, IsLinearAlongABarOfOneValue) {
    const Grid grid = make_grid({71, 1, 1}, {2, 1, 1});
    const Volume bar = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 9.0; });
    const Volume seeds = seeds_at(grid, {{{0, 0, 0}, 1}, {{70, 0, 0}, 2}});
    const Result<Volume> found = random_walker(bar, seeds, 2, {.sd = 1.0, .tolerance = 1e-6}, {});
    ASSERT_TRUE(found) << found.error().message;
    for (uint32_t x = 0; x <= 70; ++x)
        EXPECT_NEAR(found->value({x, 0, 0}), x / 70.0, 1e-4) << x;
}

// The same equations by elimination, in double.
std::vector<double> twin(const Volume& volume, const Volume& seeds, int label, double sd) {
    const glm::uvec3 n = volume.size();
    const glm::dvec3 h = spacing_mm(volume.grid());
    const size_t count = size_t{n.x} * n.y * n.z;
    std::vector<std::vector<double>> rows(count, std::vector<double>(count + 1));
    for (size_t i = 0; i < count; ++i) {
        const glm::uvec3 at(i % n.x, i / n.x % n.y, i / (size_t{n.x} * n.y));
        const float seed = seeds.value(at), value = volume.value(at);
        rows[i][i] = 1.0;
        if (seed > 0.0f || std::isnan(value)) {
            rows[i][count] = seed == float(label);
            continue;
        }
        double sum = 0.0;
        for (int k = 0; k < 3; ++k)
            for (const uint32_t step : {~0u, 1u}) {
                glm::uvec3 to = at;
                to[k] += step;
                if (to[k] >= n[k] || std::isnan(volume.value(to)))
                    continue;
                const double d = (volume.value(to) - value) / sd;
                const double w = std::max(1e-6, std::exp(-0.5 * d * d)) / (h[k] * h[k]);
                rows[i][to.x + n.x * (to.y + size_t{n.y} * to.z)] = -w;
                sum += w;
            }
        rows[i][i] = sum > 0.0 ? sum : 1.0;
    }
    for (size_t i = 0; i < count; ++i) // diagonally dominant: no pivots
        for (size_t j = 0; j < count; ++j) {
            const double factor = i == j ? 0.0 : rows[j][i] / rows[i][i];
            if (factor != 0.0)
                for (size_t k = i; k <= count; ++k)
                    rows[j][k] -= factor * rows[i][k];
        }
    std::vector<double> solved(count);
    for (size_t i = 0; i < count; ++i)
        solved[i] = rows[i][count] / rows[i][i];
    return solved;
}

TEST(RandomWalker, SolvesItsEquations) {
    std::mt19937 random(4);
    for (const Grid& grid :
         {make_grid({35, 4, 3}, {1, 1, 3}), make_grid({7, 8, 6}, {0.5, 0.7, 2})}) {
        std::vector<double> values(sample_count(grid));
        for (double& value : values)
            value = random() % 10 == 0 ? std::numeric_limits<double>::quiet_NaN()
                                       : double(random() % 8);
        // Values in whole steps of a standard deviation of 2: the table has them exactly.
        const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            return values[i.x + grid.size.x * (i.y + size_t{grid.size.y} * i.z)];
        });
        const Volume seeds =
            seeds_at(grid, {{{0, 0, 0}, 1}, {grid.size - 1u, 2}, {grid.size / 2u, 3}});
        const std::vector<double> expected = twin(volume, seeds, 3, 2.0);
        const Result<Volume> found =
            random_walker(volume, seeds, 3, {.sd = 2.0, .tolerance = 1e-7}, {});
        ASSERT_TRUE(found) << found.error().message;
        for (size_t i = 0; i < expected.size(); ++i) {
            const glm::uvec3 at(i % grid.size.x, i / grid.size.x % grid.size.y,
                                i / (size_t{grid.size.x} * grid.size.y));
            if (std::isnan(volume.value(at))) {
                EXPECT_TRUE(std::isnan(found->value(at)));
                continue;
            }
            // Changes of 1e-7 in each of some hundred sweeps to come, and floats.
            EXPECT_NEAR(found->value(at), expected[i], 1e-4) << i;
        }
    }
}

TEST(RandomWalker, AWeakEdgeBetweenStrongOnesHoldsIt) {
    // Two rooms of 20 samples with a wall of another value, and a hole in it.
    const Grid grid = make_grid({41, 21, 1}, {1, 1, 1});
    const Volume rooms = make_volume(grid, ScalarType::i16, [](glm::uvec3 i) {
        return i.x == 20 && (i.y < 9 || i.y > 11) ? 100.0 : 0.0;
    });
    const Volume seeds = seeds_at(grid, {{{5, 10, 0}, 1}, {{35, 10, 0}, 2}});
    const Result<Volume> found = random_walker(rooms, seeds, 1, {.sd = 10.0}, {});
    ASSERT_TRUE(found);
    for (uint32_t y = 0; y < 21; ++y)
        for (uint32_t x = 0; x < 41; ++x)
            if (x < 19) {
                EXPECT_GT(found->value({x, y, 0}), 0.5f) << x << " " << y;
            } else if (x > 21) {
                EXPECT_LT(found->value({x, y, 0}), 0.5f) << x << " " << y;
            }
}

TEST(RandomWalker, AnyNumberOfThreadsGivesTheSameBitsAndBadSeedsAreASentence) {
    const Grid grid = make_grid({70, 40, 5}, {1, 1, 1});
    std::mt19937 random(6);
    std::vector<float> values(sample_count(grid));
    for (float& value : values)
        value = float(random() % 50);
    const Volume volume = make_volume(grid, std::span<const float>(values));
    const Volume seeds = seeds_at(grid, {{{3, 3, 3}, 1}, {{66, 36, 1}, 2}});
    std::vector<Volume> found;
    for (const size_t threads : {1u, 2u, 4u}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        found.push_back(*random_walker(volume, seeds, 1, {.sd = 20.0, .tolerance = 1e-2}, {}));
    }
    for_each_brick(found[0], [&](glm::uvec3 at) {
        EXPECT_EQ(differing_blocks(found[0].brick(at), found[1].brick(at)), 0u);
        EXPECT_EQ(differing_blocks(found[0].brick(at), found[2].brick(at)), 0u);
    });
    const Volume one = seeds_at(grid, {{{3, 3, 3}, 1}});
    EXPECT_THAT(random_walker(volume, one, 1, {}, {}).error().message,
                testing::HasSubstr("at least two labels, such as inside and outside, found 1"));
    EXPECT_THAT(random_walker(volume, seeds, 5, {}, {}).error().message,
                testing::HasSubstr("no seed has label 5"));
}

} // namespace
} // namespace palpate
