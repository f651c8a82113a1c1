#include "bench/study/liver_phantom.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include "bench/study/samples.h"

namespace palpate::bench {
namespace {

const LiverPhantom& phantom_of(uint64_t number) { // made once
    static std::map<uint64_t, LiverPhantom> made;
    if (!made.contains(number))
        made.emplace(number, liver_phantom(number));
    return made.at(number);
}

TEST(LiverPhantom, IsAFunctionOfItsNumber) {
    const LiverPhantom a = liver_phantom(3), b = liver_phantom(3), c = liver_phantom(4);
    EXPECT_EQ(samples_of(a.volume), samples_of(b.volume));
    EXPECT_EQ(samples_of(a.truth), samples_of(b.truth));
    EXPECT_NE(a.volume.grid(), c.volume.grid());
}

// A liver has 0.8 to 2.4 l in adults.
TEST(LiverPhantom, HasALiverOfAPersonsSizeAwayFromTheBorder) {
    for (uint64_t number = 0; number < 6; ++number) {
        const Volume truth = phantom_of(number).truth;
        const glm::dvec3 spacing = spacing_mm(truth.grid());
        const std::vector<float> values = samples_of(truth);
        const double ml = std::accumulate(values.begin(), values.end(), 0.0) * spacing.x *
                          spacing.y * spacing.z / 1000.0;
        EXPECT_GT(ml, 800.0) << number;
        EXPECT_LT(ml, 2400.0) << number;
        const glm::uvec3 n = truth.size();
        for (uint32_t y = 0; y < n.y; ++y)
            for (uint32_t x = 0; x < n.x; ++x)
                ASSERT_EQ(truth.value({x, y, 0}) + truth.value({x, y, n.z - 1}), 0.0f) << number;
    }
}

// Deep in the liver the noise is what the phantom says. Between samples of one slice that are
// neighbours it is correlated by 1/2 (two of the four terms of either are the same), between slices
// by 0. The liver's vessels and lesions, 45 HU away, are few; the median leaves them out.
TEST(LiverPhantom, HasTheNoiseThatItSays) {
    for (uint64_t number = 0; number < 3; ++number) {
        const LiverPhantom& phantom = phantom_of(number);
        const glm::uvec3 n = phantom.volume.size();
        std::vector<double> across, along;
        for (uint32_t z = 1; z + 1 < n.z; ++z)
            for (uint32_t y = 1; y + 1 < n.y; ++y)
                for (uint32_t x = 1; x + 1 < n.x; ++x) {
                    bool inside = true;
                    for (uint32_t k = 0; k < 27 && inside; ++k)
                        inside = phantom.truth.value(
                                     {x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1}) != 0.0f;
                    if (!inside)
                        continue;
                    const double here = phantom.volume.value({x, y, z});
                    across.push_back(std::abs(phantom.volume.value({x, y, z + 1}) - here));
                    along.push_back(std::abs(phantom.volume.value({x + 1, y, z}) - here));
                }
        ASSERT_GT(across.size(), 1000u);
        // The median of |d| is 0.6745 of the standard deviation of a normal d.
        const auto deviation = [](std::vector<double> values) {
            std::nth_element(values.begin(), values.begin() + ptrdiff_t(values.size() / 2),
                             values.end());
            return values[values.size() / 2] / 0.6745;
        };
        EXPECT_NEAR(deviation(across), std::sqrt(2.0) * phantom.noise_hu, 0.12 * phantom.noise_hu)
            << number;
        EXPECT_NEAR(deviation(along), phantom.noise_hu, 0.12 * phantom.noise_hu) << number;
    }
}

// About half have a place where the liver's value goes on into the heart.
TEST(LiverPhantom, SomeLeakIntoTheHeart) {
    int leaking = 0;
    for (uint64_t number = 0; number < 6; ++number)
        leaking += phantom_of(number).bridge_mm > 0.0;
    EXPECT_GT(leaking, 0);
    EXPECT_LT(leaking, 6);
}

} // namespace
} // namespace palpate::bench
