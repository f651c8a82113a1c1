#include "haptics/field/sphere_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace palpate::haptics {
namespace {

// nearest() looks at some of the directions only: at those that all of them say.
TEST(SphereSamples, FindsTheNearestOfAll) {
    SphereSamples samples;
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    for (const uint32_t count : {1u, 2u, 3u, 5u, 12u, 47u, 340u, 2000u, SphereSamples::kMost}) {
        const std::span<const glm::dvec3> all = samples.directions(count);
        ASSERT_EQ(all.size(), count);
        for (int trial = 0; trial < 2000; ++trial) {
            glm::dvec3 way(normal(random), normal(random), normal(random));
            if (trial % 4 == 0) // about the poles, where the spiral is least even
                way *= glm::dvec3(0.1, 0.1, 1.0);
            way = glm::normalize(way);
            const auto nearest = std::max_element(
                all.begin(), all.end(),
                [&](glm::dvec3 a, glm::dvec3 b) { return glm::dot(way, a) < glm::dot(way, b); });
            ASSERT_EQ(samples.nearest(way), nearest - all.begin())
                << count << " directions, " << way.x << " " << way.y << " " << way.z;
        }
    }
}

} // namespace
} // namespace palpate::haptics
