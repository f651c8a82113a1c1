#include "engine/image/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Image image_of(glm::uvec2 size_px, std::vector<std::string> channels, std::vector<float> samples) {
    return {size_px, std::move(channels), std::move(samples)};
}

TEST(CompareImages, MeasuresWhatAHandMeasures) {
    const Image a = image_of({2, 2}, {"R", "G", "B", "depth"},
                             {0.0f, 0.5f, 1.0f, 10.0f, 0.0f, 0.0f, 0.0f, 20.0f, //
                              1.0f, 1.0f, 1.0f, 30.0f, 0.5f, 0.5f, 0.5f, 40.0f});
    Image b = a;
    b.at(0, 0, 0) = 0.5f;  // R + 0.5
    b.at(0, 0, 1) = 0.25f; // G - 0.25
    b.at(1, 0, 2) = 0.25f; // B + 0.25
    b.at(1, 1, 3) = 44.0f; // depth + 4
    const auto found = compare_images(a, b, 0.25);
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_EQ(found->channels.size(), 4u);

    const SampleDifference& red = found->channels[0];
    EXPECT_EQ(red.channel, "R");
    EXPECT_EQ(red.max_abs, 0.5);
    EXPECT_EQ(red.rmse, 0.25);         // sqrt(0.5^2 / 4)
    EXPECT_EQ(red.mean_signed, 0.125); // 0.5 / 4
    EXPECT_EQ(red.beyond, 1u);
    EXPECT_EQ(red.share_beyond, 0.25);

    const SampleDifference& green = found->channels[1];
    EXPECT_EQ(green.mean_signed, -0.0625);
    EXPECT_EQ(green.beyond, 0u); // a difference of the bound itself is within it

    ASSERT_TRUE(found->rgb);
    EXPECT_EQ(found->rgb->max_abs, 0.5);
    EXPECT_DOUBLE_EQ(found->rgb->rmse, std::sqrt((0.25 + 0.0625 + 0.0625) / 12.0));
    EXPECT_DOUBLE_EQ(found->rgb->mean_signed, (0.5 - 0.25 + 0.25) / 12.0);
    EXPECT_EQ(found->rgb->beyond, 1u); // pixels, not samples

    EXPECT_EQ(found->all.max_abs, 4.0);
    EXPECT_EQ(found->all.beyond, 2u);
    EXPECT_EQ(found->all.share_beyond, 0.5);
    EXPECT_TRUE(found->flip_mean);
}

TEST(CompareImages, FindsNothingBetweenAnImageAndItself) {
    const Image a = image_of({2, 1}, {"R", "G", "B"}, {kNaN, kInfinity, 0.5f, -kInfinity, 0, 1});
    const auto found = compare_images(a, a, 0.0);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->all.max_abs, 0.0);
    EXPECT_EQ(found->all.beyond, 0u);
    EXPECT_EQ(found->all.nan_mismatch, 0u);
    EXPECT_EQ(found->neighborhood_match_share, 1.0);
    EXPECT_EQ(found->flip_mean, 0.0);
}

TEST(CompareImages, CountsApartWhatCannotBeMeasured) {
    const Image a = image_of({4, 1}, {"value"}, {kNaN, 1.0f, kInfinity, 2.0f});
    const Image b = image_of({4, 1}, {"value"}, {1.0f, 1.5f, -kInfinity, kNaN});
    const auto found = compare_images(a, b, 1000.0);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->all.nan_mismatch, 3u);
    EXPECT_EQ(found->all.beyond, 3u); // beyond any bound
    EXPECT_EQ(found->all.max_abs, 0.5);
    EXPECT_EQ(found->all.rmse, 0.5); // of the one sample that can be measured
    EXPECT_FALSE(found->flip_mean);
    EXPECT_FALSE(found->rgb);
}

TEST(CompareImages, PairsChannelsByName) {
    const Image a = image_of({1, 1}, {"R", "G", "B"}, {0.1f, 0.2f, 0.3f});
    const Image b = image_of({1, 1}, {"B", "G", "R"}, {0.3f, 0.2f, 0.1f});
    const auto found = compare_images(a, b, 0.0);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->all.beyond, 0u);
    EXPECT_EQ(found->neighborhood_match_share, 1.0);
}

TEST(CompareImages, RefusesOtherSizesAndChannels) {
    const Image a = make_image({2, 2}, {"R", "G", "B"});
    const auto size = compare_images(a, make_image({2, 3}, {"R", "G", "B"}), 0.0);
    ASSERT_FALSE(size);
    EXPECT_NE(size.error().message.find("2 x 3"), std::string::npos);
    EXPECT_FALSE(compare_images(a, make_image({2, 2}, {"R", "G", "B", "A"}), 0.0));
    EXPECT_FALSE(compare_images(a, make_image({2, 2}, {"R", "G", "A"}), 0.0));
}

// A vertical line that moves by one pixel meets its like next door, by two it does not.
TEST(CompareImages, ForgivesEdgesThatMoveByOnePixel) {
    const auto line_at = [](uint32_t x) {
        Image image = make_image({9, 9}, {"Y"});
        for (uint32_t y = 0; y < 9; ++y)
            image.at(x, y, 0) = 1.0f;
        return image;
    };
    const auto by_one = compare_images(line_at(4), line_at(5), 0.0);
    const auto by_two = compare_images(line_at(4), line_at(6), 0.0);
    ASSERT_TRUE(by_one && by_two);
    EXPECT_EQ(by_one->all.beyond, 18u);
    EXPECT_EQ(by_one->neighborhood_match_share, 1.0);
    EXPECT_EQ(by_two->neighborhood_match_share, 63.0 / 81.0); // but for the two lines
}

TEST(DifferenceImage, ShowsTheAbsoluteDifferenceOpaquely) {
    const Image a = image_of({2, 1}, {"R", "A"}, {0.5f, 0.0f, kNaN, 0.0f});
    const Image b = image_of({2, 1}, {"A", "R"}, {0.0f, 0.25f, 0.5f, 0.25f});
    EXPECT_EQ(difference_image(a, b, 2.0f).samples, (std::vector<float>{0.5f, 1.0f, 1.0f, 1.0f}));
}

TEST(CompareImages, RefusesABoundBelowNothing) {
    const Image a = image_of({1, 1}, {"R"}, {0.5f});
    for (const double bound : {-0.1, double{kNaN}})
        EXPECT_FALSE(compare_images(a, a, bound)) << bound;
}

} // namespace
} // namespace palpate
