#include "engine/image/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate {
namespace {

// An image by formula: color(u, v) at pixel centres, both in 0 .. 1.
template <class Color>
Image picture(glm::uvec2 size_px, Color color) {
    Image image = make_image(size_px, {"R", "G", "B"});
    for (uint32_t y = 0; y < size_px.y; ++y)
        for (uint32_t x = 0; x < size_px.x; ++x) {
            const glm::dvec3 c = color((x + 0.5) / size_px.x, (y + 0.5) / size_px.y);
            for (int i = 0; i < 3; ++i)
                image.at(x, y, static_cast<size_t>(i)) = static_cast<float>(c[i]);
        }
    return image;
}

Image plain(glm::dvec3 color) {
    return picture({16, 16}, [&](double, double) { return color; });
}

Image waves(double phase) {
    return picture({96, 64}, [&](double u, double v) {
        return 0.5 + 0.5 * glm::dvec3(std::sin(20.0 * u + phase), std::sin(14.0 * v + phase),
                                      std::cos(9.0 * (u + v) + phase));
    });
}

// Squares of 8 pixels, moved left by `shift` pixels.
Image checkerboard(uint32_t shift) {
    Image image = make_image({96, 64}, {"R", "G", "B"});
    for (uint32_t y = 0; y < 64; ++y)
        for (uint32_t x = 0; x < 96; ++x)
            for (size_t c = 0; c < 3; ++c)
                image.at(x, y, c) = ((x + shift) / 8 + y / 8) % 2 ? 0.9f : 0.1f;
    return image;
}

double mean(const std::vector<double>& map) {
    return std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
}

double flip_mean(const Image& a, const Image& b, double ppd = kFlipPixelsPerDegree) {
    return mean(flip_map(a, b, ppd).value());
}

TEST(Flip, IsNothingBetweenAnImageAndItself) {
    const auto map = flip_map(waves(0.0), waves(0.0));
    EXPECT_EQ(*std::max_element(map->begin(), map->end()), 0.0);
}

TEST(Flip, DefaultDistanceIsThePublishedOne) {
    // pixels per metre times the length of a degree at 0.7 m
    EXPECT_NEAR(kFlipPixelsPerDegree, 0.7 * (3840.0 / 0.7) * std::acos(-1.0) / 180.0, 1e-12);
}

// The largest error of the method is that between green and blue, by its definition.
TEST(Flip, IsOneFromGreenToBlue) {
    EXPECT_NEAR(flip_mean(plain({0, 1, 0}), plain({0, 0, 1})), 1.0, 1e-12);
}

// Black and white differ by 100 in L* and in nothing else. Green has L* = 87.7347, a* = -86.1827,
// b* = 83.1793 and blue 32.2970, 79.1875, -107.8602 (CIELab of the sRGB primaries under D65), so
// after Hunt's weight 0.01 L* their HyAB distance is 55.4377 + |(-101.188, 107.813)| = 203.298, and
// with exponent 0.7 the errors are 25.1189 and 41.276: black to white is beyond the knee at 0.4 and
// remapped to 0.95 + 0.05 (25.1189 - 16.5104) / (41.276 - 16.5104).
TEST(Flip, BlackToWhiteIsWhatTheFormulasGive) {
    EXPECT_NEAR(flip_mean(plain({0, 0, 0}), plain({1, 1, 1})), 0.96738, 1e-5);
}

TEST(Flip, IsSymmetricAndBetweenZeroAndOne) {
    const auto there = flip_map(waves(0.0), checkerboard(0)).value();
    const auto back = flip_map(checkerboard(0), waves(0.0)).value();
    for (size_t i = 0; i < there.size(); ++i) {
        ASSERT_NEAR(there[i], back[i], 1e-12);
        ASSERT_GE(there[i], 0.0);
        ASSERT_LE(there[i], 1.0);
    }
}

// Farther away, the same change of fine detail is seen less.
TEST(Flip, FadesWithDistance) {
    const double near = flip_mean(checkerboard(0), checkerboard(1), 30.0);
    const double far = flip_mean(checkerboard(0), checkerboard(1), 400.0);
    EXPECT_LT(far, 0.7 * near);
}

// Means given by the authors' own evaluator (NVlabs/flip, version 1.7, C++) for the same formulas.
// It computes in single precision, and the exponent 0.5 of the feature term turns its rounding
// errors of 1e-7 into 3e-4 where there are no features; over a picture, that leaves less than 1e-4.
TEST(Flip, AgreesWithThePublishedEvaluator) {
    EXPECT_NEAR(flip_mean(waves(0.0), waves(0.3)), 0.5195662, 1e-4);
    EXPECT_NEAR(flip_mean(waves(0.0), waves(0.3), 30.0), 0.5124887, 1e-4);
    EXPECT_NEAR(flip_mean(checkerboard(0), checkerboard(1)), 0.2872471, 1e-4);
    EXPECT_NEAR(flip_mean(checkerboard(0), checkerboard(1), 30.0), 0.2421586, 1e-4);
    const auto ramp = [](double blue) {
        return picture({96, 64}, [=](double u, double v) { return glm::dvec3(u, v, blue); });
    };
    EXPECT_NEAR(flip_mean(ramp(0.5), ramp(0.6)), 0.2712815, 1e-4);
}

TEST(Flip, TakesGreyAndIgnoresWhatIsNoColour) {
    const auto grey = [](float v) { return Image{{1, 1}, {"Y", "A"}, {v, 1.0f}}; };
    EXPECT_NEAR(flip_mean(grey(0.5f), grey(1.0f)), 0.84708, 1e-4); // the same evaluator
    EXPECT_FALSE(flip_map(make_image({2, 2}, {"depth"}), make_image({2, 2}, {"depth"})));
}

} // namespace
} // namespace palpate
