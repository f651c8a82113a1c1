#include "bench/suite/errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "bench/suite/measure.h"
#include "engine/volume/extent.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

Image of(std::vector<std::string> channels, std::vector<float> samples, glm::uvec2 size) {
    Image image = make_image(size, std::move(channels));
    image.samples = std::move(samples);
    return image;
}

TEST(Errors, OfColoursAreOverAllThreeChannels) {
    const Image truth = of({"R", "G", "B"}, {0, 0, 0, 0.5f, 0.5f, 0.5f}, {2, 1});
    const Image picture = of({"R", "G", "B"}, {0.25f, 0, 0, 0.5f, 0, 0.5f}, {2, 1});
    const Errors e = errors_of(picture, truth, Metric::color, 1.0);
    EXPECT_EQ(e.count, 6u);
    EXPECT_DOUBLE_EQ(e.rmse, std::sqrt((0.0625 + 0.25) / 6.0));
    EXPECT_DOUBLE_EQ(e.max, 0.5);
    EXPECT_DOUBLE_EQ(e.p999, 0.5);
    EXPECT_DOUBLE_EQ(e.mean_signed, (0.25 - 0.5) / 6.0);
    EXPECT_GT(e.flip_mean, 0.0);
    EXPECT_EQ(errors_of(truth, truth, Metric::color, 1.0).rmse, 0.0);
    EXPECT_EQ(errors_of(truth, truth, Metric::color, 1.0).flip_mean, 0.0);
}

TEST(Errors, OfValuesLeaveOutRaysThatMiss) {
    const Image truth = of({"value"}, {10, kNone, 30}, {3, 1});
    const Image picture = of({"value"}, {13, kNone, 26}, {3, 1});
    const Errors e = errors_of(picture, truth, Metric::value, 1.0);
    EXPECT_EQ(e.count, 2u);
    EXPECT_DOUBLE_EQ(e.rmse, std::sqrt((9.0 + 16.0) / 2.0));
    EXPECT_DOUBLE_EQ(e.mean_signed, -0.5);
    EXPECT_LT(e.flip_mean, 0.0); // no colours
}

TEST(Errors, OfSurfacesAreInSamplesAndAtMostOne) {
    // Rays: right, a quarter sample off, far off, missed, false, none.
    const Image truth = of({"depth"}, {100, 100, 100, 100, kNone, kNone}, {6, 1});
    const Image picture = of({"depth"}, {100, 100.5f, 900, kNone, 100, kNone}, {6, 1});
    const Errors e = errors_of(picture, truth, Metric::surface, /*sample_mm=*/2.0);
    EXPECT_EQ(e.count, 5u);
    EXPECT_DOUBLE_EQ(e.rmse, std::sqrt((0.0625 + 3.0) / 5.0));
    EXPECT_EQ(e.max, 1.0);
    // A picture that knows only where it hits is taken as right about the depth.
    const Image hits = of({"hit"}, {1, 1, 1, 0, 1, 0}, {6, 1});
    EXPECT_DOUBLE_EQ(errors_of(hits, truth, Metric::surface, 2.0).rmse, std::sqrt(2.0 / 5.0));
    const std::vector<double> map = difference_map(picture, truth, Metric::surface, 2.0);
    EXPECT_EQ(map[1], 0.25);
    EXPECT_EQ(map[3], 1.0);
    EXPECT_TRUE(std::isnan(map[5]));
}

TEST(Sampling, TakesTheMiddlePixelsOfItsSquares) {
    Image picture = make_image(glm::uvec2(7), {"value"});
    for (uint32_t y = 0; y < 7; ++y)
        for (uint32_t x = 0; x < 7; ++x)
            picture.at(x, y, 0) = static_cast<float>(10 * y + x);
    const Sampling every{7, 1}, third{7, 3};
    EXPECT_EQ(every.rays(), 7u);
    EXPECT_EQ(every.of(picture).samples, picture.samples);
    EXPECT_EQ(third.rays(), 2u);
    EXPECT_EQ(third.of(picture).samples, (std::vector<float>{11, 14, 41, 44}));
}

TEST(Subjects, ThePeersCameraIsThatOfTheComparison) {
    // as bench/suite/subject.cpp: distance 0.8 * half diagonal / sin(15 deg), from +y, 30 degrees
    // up.
    const Sample sample = ball(33);
    const double diagonal = std::sqrt(3.0) * 100.0;
    const double distance = 0.8 * diagonal / 2.0 / std::sin(std::acos(-1.0) / 12.0);
    const Camera camera = peer_camera(sample.volume);
    EXPECT_NEAR(camera.target_mm.x, 50.0, 1e-9); // the first sample is the origin
    const glm::dvec3 arm = camera.eye_mm - camera.target_mm;
    EXPECT_NEAR(arm.x, 0.0, 1e-9);
    EXPECT_NEAR(arm.y, distance * std::sqrt(0.75), 1e-9);
    EXPECT_NEAR(arm.z, distance * 0.5, 1e-9);
}

TEST(Subjects, ResamplingKeepsTheEndsAndTheExtent) {
    const Sample coarse = ball(17);
    const Sample fine = resampled(coarse, glm::uvec3(33), "fine");
    EXPECT_EQ(fine.volume.value({0, 0, 0}), coarse.volume.value({0, 0, 0}));
    EXPECT_EQ(fine.volume.value({32, 32, 32}), coarse.volume.value({16, 16, 16}));
    EXPECT_EQ(fine.volume.value({16, 16, 16}), coarse.volume.value({8, 8, 8}));
    EXPECT_NEAR(smallest_spacing_mm(fine.volume.grid()),
                0.5 * smallest_spacing_mm(coarse.volume.grid()), 1e-12);
}

TEST(Settings, EveryFrontHoldsTheDefault) {
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso})
        for (const bool full : {false, true}) {
            int found = 0;
            for (const Setting& setting : settings_of(mode, full))
                found += setting.name() == default_setting().name();
            EXPECT_EQ(found, 1);
        }
}

} // namespace
} // namespace palpate::bench
