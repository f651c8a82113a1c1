#include "haptics/servo/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

namespace palpate::haptics {
namespace {

TEST(Histogram, PercentilesAreAtMostAThirtySecondAboveThoseOfTheSortedList) {
    std::mt19937_64 random(5);
    for (const int bits : {5, 10, 20, 40, 63}) {
        const auto histogram = std::make_unique<Histogram>();
        std::vector<uint64_t> all;
        for (int i = 0; i < 5000; ++i) {
            all.push_back(random() >> (64 - bits) >> random() % 3);
            histogram->add(all.back());
        }
        std::sort(all.begin(), all.end());
        for (const double share : {0.0001, 0.25, 0.5, 0.99, 0.999, 1.0}) {
            const auto rank = static_cast<size_t>(std::ceil(share * 5000)) - 1;
            const uint64_t got = histogram->percentile(share);
            EXPECT_GE(got, all[rank]) << bits << ' ' << share;
            EXPECT_LE(got, all[rank] + all[rank] / 32) << bits << ' ' << share;
        }
        EXPECT_EQ(histogram->max(), all.back());
        EXPECT_EQ(histogram->count(), 5000u);
    }
}

TEST(Histogram, HasRoomForEveryNumber) {
    const auto histogram = std::make_unique<Histogram>();
    EXPECT_EQ(histogram->percentile(0.5), 0u);
    for (const uint64_t value : {uint64_t{0}, uint64_t{63}, uint64_t{64}, ~uint64_t{0}})
        histogram->add(value);
    EXPECT_EQ(histogram->percentile(0.25), 0u);
    EXPECT_EQ(histogram->percentile(0.5), 63u);
    EXPECT_EQ(histogram->percentile(1.0), ~uint64_t{0});
}

} // namespace
} // namespace palpate::haptics
