#include "bench/study/liver_phantom.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <vector>

#include "bench/study/samples.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {
namespace {

const LiverPhantom& phantom_of(uint64_t number) { // made once
    static std::map<uint64_t, LiverPhantom> made;
    if (!made.contains(number))
        made.emplace(number, liver_phantom(number));
    return made.at(number);
}

// LiverPhantom takes over 5 s of a processor: dozens of phantoms of full size are made.
TEST(LiverPhantom, IsAFunctionOfItsNumber) {
    const LiverPhantom a = liver_phantom(3), b = liver_phantom(3), c = liver_phantom(4);
    EXPECT_EQ(samples_of(a.volume), samples_of(b.volume));
    EXPECT_EQ(samples_of(a.truth), samples_of(b.truth));
    EXPECT_NE(a.volume.grid(), c.volume.grid());
}

// CT found 594 ml at least in 369 adults (Feng et al., World J. Gastroenterol. 2017, 23:4968); MR
// found 1505 +- 385 ml in 2773 (reference values, Eur. J. Radiol. 2018, 106:32), the upper end of
// which is taken at two standard deviations.
TEST(LiverPhantom, HasALiverOfAPersonsSizeAwayFromTheBorder) {
    for (uint64_t number = 0; number < 6; ++number) {
        const Volume truth = phantom_of(number).truth;
        const glm::dvec3 spacing = spacing_mm(truth.grid());
        const std::vector<float> values = samples_of(truth);
        const double ml = std::accumulate(values.begin(), values.end(), 0.0) * spacing.x *
                          spacing.y * spacing.z / 1000.0;
        EXPECT_GT(ml, 594.0) << number;
        EXPECT_LT(ml, 1505.0 + 2.0 * 385.0) << number;
        const glm::uvec3 n = truth.size();
        for (uint32_t y = 0; y < n.y; ++y)
            for (uint32_t x = 0; x < n.x; ++x)
                ASSERT_EQ(truth.value({x, y, 0}) + truth.value({x, y, n.z - 1}), 0.0f) << number;
    }
}

// The noise is computed again here: half the sum of four values of synthetic::noise, which has
// variance 1. Without it the picture is left, rounded to whole numbers: deep in the liver one value
// within 1 HU, but for vessels, lesions and their edges. Those are at most 14 capsules of 38 mm (2
// of 6, 4 of 4.2, 8 of 2.94 mm) and 3 balls of 16 mm, each wider by half an edge of 5 mm: 162 ml.
// Noise that were off by 5 % of the 6 HU or more that it has would leave a quarter outside.
TEST(LiverPhantom, HasTheNoiseThatItSays) {
    for (uint64_t number = 0; number < 3; ++number) {
        const LiverPhantom& phantom = phantom_of(number);
        EXPECT_GT(phantom.noise_hu, 6.0) << number;
        const glm::uvec3 n = phantom.volume.size();
        std::vector<double> picture;
        for (uint32_t z = 1; z + 1 < n.z; ++z)
            for (uint32_t y = 1; y + 1 < n.y; ++y)
                for (uint32_t x = 1; x + 1 < n.x; ++x) {
                    bool inside = true;
                    for (uint32_t k = 0; k < 27 && inside; ++k)
                        inside = phantom.truth.value(
                                     {x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1}) != 0.0f;
                    if (!inside)
                        continue;
                    double noise = 0.0;
                    for (const glm::uvec3 d : {glm::uvec3(0), {1, 0, 0}, {0, 1, 0}, {1, 1, 0}})
                        noise += synthetic::noise(glm::uvec3(x, y, z) + d, number) / 2.0;
                    picture.push_back(double{phantom.volume.value({x, y, z})} -
                                      phantom.noise_hu * noise);
                }
        const glm::dvec3 spacing = spacing_mm(phantom.volume.grid());
        const double deep_ml = double(picture.size()) * spacing.x * spacing.y * spacing.z / 1000.0;
        ASSERT_GT(deep_ml, 324.0) << number;
        std::sort(picture.begin(), picture.end());
        size_t most = 0; // samples within 1 HU
        for (size_t low = 0, high = 0; high < picture.size(); ++high) {
            while (picture[high] - picture[low] > 1.0 + 1e-9)
                ++low;
            most = std::max(most, high - low + 1);
        }
        EXPECT_GE(double(most) / double(picture.size()), 1.0 - 162.0 / deep_ml) << number;
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
