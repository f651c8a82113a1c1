#include "engine/volume/sample.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool same_bits(double a, double b) {
    return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b);
}

bool same_or_both_nan(double a, double b) {
    return (std::isnan(a) && std::isnan(b)) || same_bits(a, b);
}

std::vector<glm::uvec3> sizes() {
    return {{1, 1, 1}, {1, 40, 1}, {33, 1, 65}, {2, 2, 2}, {70, 35, 33}, {32, 32, 32}};
}

Volume noisy(glm::uvec3 size) { // f32, and one sample in 50 has no data
    return make_volume(make_grid(size, {0.5, 0.5, 3.0}), ScalarType::f32, [](glm::uvec3 i) {
        return i.x % 50 == 49 ? kNaN : 100.0 * synthetic::noise(i, 9);
    });
}

// Random points inside and a little outside, whole indices, faces and corners.
std::vector<glm::dvec3> points(glm::uvec3 size) {
    std::mt19937_64 random(size.x + 100 * size.y);
    std::uniform_real_distribution<double> uniform(-0.1, 1.1);
    const glm::dvec3 last = glm::dvec3(size) - 1.0;
    std::vector<glm::dvec3> all{{}, last, 0.5 * last, {kNaN, 0, 0}, {0, INFINITY, 0}, {-0.0, 0, 0}};
    for (int i = 0; i < 2000; ++i) {
        glm::dvec3 p = glm::dvec3(uniform(random), uniform(random), uniform(random)) * last;
        for (int axis = 0; axis < 3; ++axis)
            switch (random() % 6) {
                case 0:
                    p[axis] = std::floor(p[axis]);
                    break;
                case 1:
                    p[axis] = 0.0;
                    break;
                case 2:
                    p[axis] = last[axis];
                    break;
                default:
                    break;
            }
        all.push_back(p);
    }
    return all;
}

TEST(SampleCursor, GivesTheBitsOfTrilinearAndCentralGradient) {
    for (const glm::uvec3 size : sizes()) {
        const Volume volume = noisy(size);
        SampleCursor cursor(volume);
        int inside = 0;
        for (const glm::dvec3 p : points(size)) {
            const double expected = trilinear(volume, p);
            ASSERT_TRUE(same_or_both_nan(cursor.value(p), expected)) << p.x << " " << p.y;
            const glm::dvec3 a = cursor.gradient(p), b = central_gradient(volume, p);
            for (int axis = 0; axis < 3; ++axis)
                ASSERT_TRUE(same_or_both_nan(a[axis], b[axis]));
            inside += !std::isnan(expected);
        }
        EXPECT_GT(inside, 100);
    }
}

// Weights are products of three fractions; the sum of eight such terms of values up to 600 differs
// from nested interpolation by a dozen roundings of 600, 8e-13.
TEST(Trilinear, IsTheWeightedMeanOfEightCorners) {
    const glm::uvec3 size(40, 35, 33);
    const Volume volume = make_volume(make_grid(size, {1, 1, 1}), ScalarType::f32,
                                      [](glm::uvec3 i) { return 100.0 * synthetic::noise(i, 4); });
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int n = 0; n < 2000; ++n) {
        const glm::dvec3 p = glm::dvec3(uniform(random), uniform(random), uniform(random)) *
                             (glm::dvec3(size) - 1.0);
        const glm::dvec3 low = glm::floor(p), f = p - low;
        double sum = 0.0;
        for (uint32_t i = 0; i < 8; ++i) {
            const glm::uvec3 corner(i & 1, i >> 1 & 1, i >> 2);
            const glm::dvec3 w = glm::mix(1.0 - f, f, glm::dvec3(corner));
            sum += w.x * w.y * w.z * volume.value(glm::uvec3(low) + corner);
        }
        ASSERT_NEAR(trilinear(volume, p), sum, 8e-13);
    }
}

TEST(Trilinear, IsTheSampleAtASampleAndNaNOutside) {
    for (const glm::uvec3 size : sizes()) {
        const Volume volume =
            make_volume(make_grid(size, {1, 1, 1}), ScalarType::i16,
                        [](glm::uvec3 i) { return 100.0 * synthetic::noise(i, 1); });
        const glm::uvec3 last = size - 1u;
        for (const glm::uvec3 i : {glm::uvec3(0), last, last / 2u, glm::uvec3(last.x, 0, last.z)})
            EXPECT_EQ(trilinear(volume, glm::dvec3(i)), volume.value(i));
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 below(last / 2u), above(last / 2u);
            below[axis] = -1e-12;
            above[axis] = last[axis] + 1e-12;
            EXPECT_TRUE(std::isnan(trilinear(volume, below)));
            EXPECT_TRUE(std::isnan(trilinear(volume, above)));
        }
    }
}

// On an axis of one sample nothing can differ: the gradient there is 0 and the value the sample.
TEST(Sample, VolumesOfOneSampleOnAnAxis) {
    const Volume one = make_volume(make_grid({1, 1, 1}, {1, 1, 1}), ScalarType::u8,
                                   [](glm::uvec3) { return 42.0; });
    EXPECT_EQ(trilinear(one, {}), 42.0);
    EXPECT_EQ(central_gradient(one, {}), glm::dvec3(0.0));
    EXPECT_EQ(one.range(), (ValueRange{42.0f, 42.0f}));
    EXPECT_EQ(one.brick_count(), glm::uvec3(1));

    const Volume line = make_volume(make_grid({1, 70, 1}, {1, 1, 1}), ScalarType::u8,
                                    [](glm::uvec3 i) { return 2.0 * i.y; });
    EXPECT_EQ(trilinear(line, {0.0, 33.25, 0.0}), 66.5);
    EXPECT_EQ(central_gradient(line, {0.0, 33.25, 0.0}), glm::dvec3(0.0, 2.0, 0.0));
    EXPECT_EQ(central_gradient(line, {0.0, 69.0, 0.0}), glm::dvec3(0.0, 1.0, 0.0)); // one-sided
    EXPECT_TRUE(std::isnan(trilinear(line, {0.1, 33.25, 0.0})));
}

TEST(ReadRow, EqualsTheSamplesAcrossBricks) {
    const Volume volume = noisy({100, 3, 2});
    std::vector<float> row(100);
    for (const auto& [start, count] : {std::pair(0u, 100u), {31u, 2u}, {64u, 36u}, {99u, 1u}}) {
        read_row(volume, {start, 2, 1}, count, row.data());
        for (uint32_t i = 0; i < count; ++i)
            ASSERT_TRUE(same_or_both_nan(row[i], volume.value({start + i, 2, 1})));
    }
}

} // namespace
} // namespace palpate
