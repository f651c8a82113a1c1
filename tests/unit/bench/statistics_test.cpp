#include "bench/suite/statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace palpate::bench {
namespace {

using ::testing::ElementsAre;

TEST(Spread, HoldsTheMedianInNinetyFiveOfAHundredRuns) {
    std::mt19937 random(7);
    std::exponential_distribution<double> skewed(1.0); // median ln 2; far from normal
    for (const size_t n : {6u, 9u, 30u}) {
        int held = 0;
        constexpr int kRuns = 4000;
        for (int run = 0; run < kRuns; ++run) {
            std::vector<double> values(n);
            for (double& value : values)
                value = skewed(random);
            const Spread s = spread(values);
            held += s.low <= std::log(2.0) && std::log(2.0) <= s.high;
        }
        // At least 95 %, less four standard deviations of a count of 4000: 1.4 %.
        EXPECT_GE(held, static_cast<int>(0.936 * kRuns)) << n;
    }
}

TEST(Spread, TakesTheRanksOfTheBinomialDistribution) {
    std::vector<double> nine{9, 1, 8, 2, 7, 3, 6, 4, 5};
    const Spread s = spread(nine);
    // P(at most 1 of 9 heads) = 10 / 512 <= 2.5 %, of 2 heads 46 / 512: ranks 2 and 8.
    EXPECT_EQ(s.low, 2);
    EXPECT_EQ(s.high, 8);
    EXPECT_EQ(s.median, 5);
    EXPECT_EQ(s.p95, 9);
    EXPECT_DOUBLE_EQ(s.noise(), 0.6);
    const Spread one = spread({4.0});
    EXPECT_EQ(one.low, 4);
    EXPECT_EQ(one.high, 4);
    EXPECT_EQ(one.noise(), 0);
    EXPECT_EQ(spread({1, 2}).median, 1.5);
    // With 5 not even the extremes hold it in 95 of 100 runs; they are given all the same.
    EXPECT_EQ(spread({1, 2, 3, 4, 5}).low, 1);
    EXPECT_EQ(spread({1, 2, 3, 4, 5}).high, 5);
}

TEST(PowerLaw, FindsExactPowers) {
    const std::vector<double> x{1, 0.5, 0.25, 0.125};
    for (const double order : {1.0, 2.0, 3.5, -1.0}) {
        std::vector<double> y;
        for (const double step : x)
            y.push_back(0.3 * std::pow(step, order));
        const PowerLaw law = fit_power(x, y);
        // Sums of a few logarithms of size 1 to 8: some 1e-15 each.
        EXPECT_NEAR(law.order, order, 1e-13);
        EXPECT_NEAR(law.factor, 0.3, 1e-13);
        ASSERT_TRUE(law.band);
        EXPECT_NEAR(*law.band, 0.0, 1e-12);
    }
    EXPECT_FALSE(fit_power(std::vector{1.0, 2.0}, std::vector{3.0, 5.0}).band);
}

TEST(PowerLaw, TheBandHoldsTheOrderInNinetyFiveOfAHundredFits) {
    std::mt19937 random(11);
    std::normal_distribution<double> scatter(0.0, 0.1);
    int held = 0;
    constexpr int kRuns = 2000;
    for (int run = 0; run < kRuns; ++run) {
        std::vector<double> x, y;
        for (int i = 0; i < 5; ++i) {
            x.push_back(std::pow(0.5, i));
            y.push_back(std::pow(x.back(), 2.0) * std::exp(scatter(random)));
        }
        const PowerLaw law = fit_power(x, y);
        held += std::abs(law.order - 2.0) <= *law.band;
    }
    // 95 %, give or take four standard deviations of a count of 2000: 1.9 %.
    EXPECT_NEAR(held / double{kRuns}, 0.95, 0.02);
}

TEST(ParetoFront, KeepsWhatNothingDominatesInOrderOfTime) {
    const std::vector<Cost> costs{{10, 1}, {5, 2}, {7, 3}, {20, 0.5}, {5, 2.5}, {30, 0.5}, {1, 9}};
    EXPECT_THAT(pareto_front(costs), ElementsAre(6, 1, 0, 3));
    EXPECT_TRUE(pareto_front({}).empty());
    // Equal points dominate each other no more than themselves.
    EXPECT_THAT(pareto_front(std::vector<Cost>{{1, 1}, {1, 1}}), ElementsAre(0, 1));
}

TEST(ParetoFront, EveryOtherPointIsDominatedByAPointOfTheFront) {
    std::mt19937 random(3);
    std::uniform_int_distribution<int> grid(0, 30); // with ties
    std::vector<Cost> costs(300);
    for (Cost& cost : costs)
        cost = {double(grid(random)), double(grid(random))};
    const std::vector<size_t> front = pareto_front(costs);
    for (size_t i = 0; i < costs.size(); ++i) {
        const bool dominated = std::any_of(front.begin(), front.end(),
                                           [&](size_t f) { return dominates(costs[f], costs[i]); });
        const bool kept = std::find(front.begin(), front.end(), i) != front.end();
        EXPECT_NE(dominated, kept) << i;
    }
}

TEST(BeatenBy, NeedsMoreThanNoiseAndNoMoreError) {
    const Measured usual{{100, 1.0}, 0.03};
    const auto beats = [&](Cost cost, double noise) {
        return beaten_by(std::vector<Measured>{usual, {cost, noise}}, 0).has_value();
    };
    EXPECT_TRUE(beats({90, 0.5}, 0.04));  // 11 % faster, noise 5 %
    EXPECT_FALSE(beats({96, 0.5}, 0.04)); // 4 % faster
    EXPECT_FALSE(beats({99, 0.0}, 0.0));  // never by less than 2 %
    EXPECT_FALSE(beats({50, 1.01}, 0.0)); // twice as fast and less exact
    EXPECT_TRUE(beats({50, 1.0}, 0.0));   // as exact, twice as fast
    EXPECT_FALSE(beats({90, 0.5}, 0.20)); // so noisy that nobody knows
    EXPECT_EQ(beaten_by(std::vector<Measured>{usual, {{80, 1}, 0}, {{60, 1}, 0}}, 0), 2u);
}

TEST(StrictlyBelow, IsBetterBothWays) {
    EXPECT_TRUE(strictly_below({1, 1}, {2, 2}));
    EXPECT_FALSE(strictly_below({1, 2}, {2, 2}));
    EXPECT_FALSE(strictly_below({2, 1}, {2, 2}));
}

} // namespace
} // namespace palpate::bench
