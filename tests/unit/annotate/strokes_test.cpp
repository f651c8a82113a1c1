// Text and bars in a picture, and how they cover it.

#include "engine/annotate/strokes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

namespace palpate {
namespace {

double sum_of(const Image& image, size_t channel) {
    double sum = 0.0;
    for (size_t i = channel; i < image.samples.size(); i += image.channels.size())
        sum += double(image.samples[i]);
    return sum;
}

std::string text_of(const std::vector<Segment>& strokes) {
    std::string text;
    for (const Segment& s : strokes)
        for (const glm::dvec2 p : {s.from, s.to})
            text += std::to_string(p.x) + "," + std::to_string(p.y) + " ";
    return text;
}

TEST(Font, EveryPrintableCharacterHasItsOwnShapeWithinItsLine) {
    std::set<std::string> shapes;
    for (char c = '!'; c <= '~'; ++c) {
        const std::vector<Segment> strokes = text_strokes(std::string(1, c));
        EXPECT_FALSE(strokes.empty()) << c;
        for (const Segment& s : strokes)
            for (const glm::dvec2 p : {s.from, s.to}) {
                EXPECT_GE(p.x, -1e-9) << c;
                EXPECT_LE(p.x, text_width(std::string(1, c)) + 1e-9) << c;
                EXPECT_GE(p.y, -4.2) << c;
                EXPECT_LE(p.y, 16.0 + 1e-9) << c;
            }
        shapes.insert(text_of(strokes));
    }
    shapes.insert(text_of(text_strokes("|")));
    EXPECT_EQ(shapes.size(), size_t('~' - '!' + 1));
    EXPECT_TRUE(text_strokes(" ").empty());
    EXPECT_GT(text_width(" "), 0.0);
    EXPECT_EQ(text_width(""), 0.0);
    // A character that there is none of, of two bytes, and a byte that is no character.
    EXPECT_EQ(text_of(text_strokes("a\xc3\xa4z")), text_of(text_strokes("a?z")));
    EXPECT_EQ(text_of(text_strokes("\xff")), text_of(text_strokes("?")));
    EXPECT_EQ(text_of(text_strokes("\n")), text_of(text_strokes("?")));
    EXPECT_NEAR(text_width("ab"),
                text_width("a") + text_width("b") + text_width("aa") - 2 * text_width("a"), 1e-9);
}

// Letters and digits are told apart at the smallest size that figures use: where two lie best over
// each other, they still differ by the ink of a stroke of a quarter of a capital, which is what a
// reader needs to see (an I by its feet, an l by its tail).
TEST(Font, LettersAndDigitsAreToldApartWhereTheyAreSmall) {
    const Pen pen{10.0, glm::dvec3(1.0), glm::dvec3(0.0)};
    const double capital_px = pen.line_px * kCapital / kLine;
    const double least = 0.25 * capital_px * pen.thickness_px();
    constexpr int kSide = 24, kShift = 3;
    const std::string all = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789|";
    std::vector<Image> pictures;
    for (const char c : all) {
        Image image = make_image({kSide, kSide}, {"R", "G", "B"});
        draw_text(image, {12.0, 12.0}, {0.5, 0.5}, std::string(1, c), pen);
        pictures.push_back(std::move(image));
    }
    const auto ink = [&](const Image& image, int x, int y) {
        const bool in = x >= 0 && y >= 0 && x < kSide && y < kSide;
        return in ? double(image.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y), 0)) : 0.0;
    };
    for (size_t a = 0; a < all.size(); ++a)
        for (size_t b = a + 1; b < all.size(); ++b) {
            double nearest = 1e9;
            for (int shift = -kShift; shift <= kShift; ++shift) { // side by side, on one baseline
                double sum = 0.0;
                for (int y = 0; y < kSide; ++y)
                    for (int x = 0; x < kSide; ++x)
                        sum += std::abs(ink(pictures[a], x, y) - ink(pictures[b], x + shift, y));
                nearest = std::min(nearest, sum);
            }
            EXPECT_GE(nearest, least) << all[a] << " and " << all[b];
        }
}

// The covered area is that of the box, wherever it lies between pixels.
TEST(FillBox, CoversItsArea) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> real(0.0, 20.0);
    for (int i = 0; i < 200; ++i) {
        const glm::dvec2 a(real(random), real(random)), b(real(random), real(random));
        Image image = make_image({20, 20}, {"R", "G", "B", "A"});
        fill_box(image, glm::min(a, b), glm::max(a, b), {1.0, 0.5, 0.0});
        const glm::dvec2 size = glm::abs(a - b);
        EXPECT_NEAR(sum_of(image, 0), size.x * size.y, 1e-4);
        EXPECT_NEAR(sum_of(image, 1), 0.5 * size.x * size.y, 1e-4);
        EXPECT_NEAR(sum_of(image, 3), size.x * size.y, 1e-4);
    }
}

// A round pen's stroke covers length x width and a disk. Coverage by distance is exact along
// straight edges and errs by a share of a pixel round the ends.
TEST(Strokes, CoverTheAreaOfARoundPen) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> real(20.0, 80.0);
    for (int i = 0; i < 50; ++i) {
        const Segment s{{real(random), real(random)}, {real(random), real(random)}};
        const double width = 2.0 + 0.1 * static_cast<double>(i);
        Image image = make_image({100, 100}, {"R", "G", "B"});
        draw_strokes(image, std::span(&s, 1), width, glm::dvec3(1.0));
        const double area = glm::length(s.to - s.from) * width + 0.25 * M_PI * width * width;
        // The ramp of one pixel along an oblique edge sums to the half plane's share within 0.02 of
        // a pixel a pixel of edge.
        EXPECT_NEAR(sum_of(image, 0), area, 0.02 * 2.0 * glm::length(s.to - s.from) + 1.0);
    }
    Image image = make_image({10, 10}, {"R", "G", "B"});
    const Segment outside{{-50, -50}, {-20, 400}};
    draw_strokes(image, std::span(&outside, 1), 3.0, glm::dvec3(1.0));
    draw_text(image, {500, 5}, {0, 0}, "far away", {20.0, glm::dvec3(1), glm::dvec3(0)});
    EXPECT_EQ(sum_of(image, 0), 0.0);
}

Image random_picture(std::mt19937& random, glm::uvec2 size) {
    std::uniform_real_distribution<float> real(0.0f, 1.0f);
    Image image = make_image(size, {"R", "G", "B", "A", "depth"});
    for (uint32_t y = 0; y < size.y; ++y)
        for (uint32_t x = 0; x < size.x; ++x) {
            const float a = real(random) < 0.2f ? 0.0f : real(random);
            image.at(x, y, 3) = a;
            for (size_t c = 0; c < 3; ++c)
                image.at(x, y, c) = a * real(random); // associated
            image.at(x, y, 4) = NAN;
        }
    return image;
}

// The picture over a background, in double precision: the twin of what a page shows.
std::vector<double> over(const Image& image, glm::dvec3 background) {
    std::vector<double> out;
    for (size_t i = 0; i < image.samples.size(); i += image.channels.size())
        for (size_t c = 0; c < 3; ++c)
            out.push_back(double(image.samples[i + c]) +
                          (1.0 - double(image.samples[i + 3])) *
                              background[static_cast<glm::length_t>(c)]);
    return out;
}

// Marks on a transparent picture that is then laid over a background are those on the picture with
// that background.
TEST(Strokes, OnATransparentPictureAreThoseOnItsBackground) {
    std::mt19937 random(5);
    const Pen pen{14.0, {1.0, 0.9, 0.1}, {0.0, 0.1, 0.2}};
    for (const glm::dvec3 background : {glm::dvec3(0), glm::dvec3(1), glm::dvec3(0.2, 0.7, 0.4)}) {
        Image clear = random_picture(random, {90, 40});
        Image filled = clear;
        const std::vector<double> with = over(clear, background);
        for (size_t i = 0; i < with.size() / 3; ++i) {
            for (size_t c = 0; c < 3; ++c)
                filled.samples[5 * i + c] = static_cast<float>(with[3 * i + c]);
            filled.samples[5 * i + 3] = 1.0f;
        }
        for (Image* image : {&clear, &filled}) {
            draw_text(*image, {4.3, 20.0}, {0.0, 0.5}, "Rg 7", pen);
            fill_box(*image, {60.2, 10.7}, {80.9, 30.1}, {0.3, 0.6, 0.9});
        }
        const std::vector<double> a = over(clear, background), b = over(filled, background);
        for (size_t i = 0; i < a.size(); ++i) // four roundings of floats below 1
            ASSERT_NEAR(a[i], b[i], 4 * 6e-8 * 2) << i;
        EXPECT_TRUE(std::isnan(clear.samples[4])); // depths stay
    }
}

TEST(StraightAlpha, TimesAlphaIsTheAssociatedColour) {
    std::mt19937 random(6);
    const Image associated = random_picture(random, {50, 50});
    const Image straight = with_straight_alpha(associated);
    for (size_t i = 0; i < associated.samples.size(); i += 5)
        for (size_t c = 0; c < 3; ++c) {
            const float v = straight.samples[i + c], a = straight.samples[i + 3];
            EXPECT_LE(v, 1.0f);
            EXPECT_NEAR(v * a, associated.samples[i + c], 2e-7f);
        }
    const Image opaque = make_image({3, 3}, {"R", "G", "B"});
    EXPECT_EQ(with_straight_alpha(opaque).samples, opaque.samples);
}

} // namespace
} // namespace palpate
