// The geometry of marks against closed forms.

#include "engine/annotate/measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

namespace palpate {
namespace {

glm::dvec3 random_direction(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

// The direction that a letter stands for, LPS.
glm::dvec3 direction_of(char letter) {
    switch (letter) {
        case 'L':
            return {1, 0, 0};
        case 'R':
            return {-1, 0, 0};
        case 'P':
            return {0, 1, 0};
        case 'A':
            return {0, -1, 0};
        case 'S':
            return {0, 0, 1};
        default:
            return {0, 0, -1};
    }
}

// Each letter is within acos(0.2) of the direction, none that is is missing, nearest first.
TEST(Letters, AreTheSidesThatADirectionPointsTo) {
    std::mt19937 random(1);
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 v = random_direction(random);
        const std::string letters = letters_of(7.0 * v);
        double before = 1.0;
        for (const char letter : letters) {
            const double share = glm::dot(v, direction_of(letter));
            EXPECT_GE(share, 0.2 - 1e-12);
            EXPECT_LE(share, before);
            before = share;
        }
        const std::set<char> named(letters.begin(), letters.end());
        for (const char letter : std::string("LRPASI"))
            EXPECT_EQ(named.contains(letter), glm::dot(v, direction_of(letter)) >= 0.2);
    }
}

TEST(ScaleBar, IsRoundAndFillsTwoFifthsOfItsRoom) {
    for (double mm_per_px = 1e-3; mm_per_px < 100.0; mm_per_px *= 1.07) {
        const ScaleBar bar = scale_bar(mm_per_px, 150.0);
        EXPECT_NEAR(bar.px * mm_per_px, bar.mm, 1e-12 * bar.mm);
        EXPECT_LE(bar.px, 150.0 * (1 + 1e-12));
        EXPECT_GE(bar.px, 60.0 * (1 - 1e-12));
        const double digits = bar.mm / std::pow(10.0, std::floor(std::log10(bar.mm * 1.0000001)));
        EXPECT_NEAR(std::min({std::abs(digits - 1), std::abs(digits - 2), std::abs(digits - 5)}),
                    0.0, 1e-9);
    }
    EXPECT_EQ(length_text(0.5), "0.5 mm");
    EXPECT_EQ(length_text(2000.0), "2 m");
}

TEST(RoundValues, AreRoundWithinTheRangeAndNotTooMany) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> real(-3.0, 4.0);
    for (int i = 0; i < 2000; ++i) {
        const double low = std::pow(10.0, real(random)) * (random() % 2 ? 1 : -1);
        const double high = low + std::pow(10.0, real(random));
        const int most = 4 + static_cast<int>(random() % 5);
        const std::vector<double> values = round_values(low, high, most);
        ASSERT_GE(values.size(), 1u) << low << " " << high;
        ASSERT_LE(values.size(), size_t(most));
        const double slack = 1e-6 * (high - low);
        EXPECT_GE(values.front(), low - slack);
        EXPECT_LE(values.back(), high + slack);
        if (values.size() < 2)
            continue;
        const double step = values[1] - values[0];
        const double digits = step / std::pow(10.0, std::floor(std::log10(step * 1.0000001)));
        EXPECT_NEAR(std::min({std::abs(digits - 1), std::abs(digits - 2), std::abs(digits - 5)}),
                    0.0, 1e-6);
        EXPECT_LT(values.front() - low, step); // none is left out at the ends
        EXPECT_LT(high - values.back(), step);
    }
    EXPECT_EQ(round_values(-160, 240, 6), (std::vector<double>{-100, 0, 100, 200}));
}

TEST(PlaceText, NamesThePlaceAndTheLayer) {
    const Grid grid = make_grid({10, 20, 30}, {1, 2, 4}, {-5, -20, -60});
    EXPECT_EQ(place_text(grid, {0, 0, 12}, {0, 0, -3}), "S 12.0 mm, 19 of 30");
    EXPECT_EQ(place_text(grid, {3, 3, -12}, {0, 0, 1}), "I 12.0 mm, 13 of 30");
    EXPECT_EQ(place_text(grid, {0, -20, 0}, {0, 1, 0}), "A 20.0 mm, 1 of 20");
    EXPECT_EQ(place_text(grid, {4, 0, 0}, {1, 0, 0}), "L 4.0 mm, 10 of 10");
    // A turned plane through the centre is at the centre, whichever of its points is given.
    const glm::dvec3 center = center_mm(grid), normal(0.3, 0.0, 1.0);
    const glm::dvec3 in_plane(1.0, 0.0, -0.3);
    EXPECT_EQ(place_text(grid, center, normal), "I 2.0 mm, turned");
    EXPECT_EQ(place_text(grid, center + 20.0 * in_plane, normal), "I 2.0 mm, turned");
    EXPECT_EQ(window_text(-160.0, 240.0), "W 400 L 40");
}

} // namespace
} // namespace palpate
