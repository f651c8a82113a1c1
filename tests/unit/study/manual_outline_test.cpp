#include "bench/study/manual_outline.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "engine/volume/builder.h"

namespace palpate::bench {
namespace {

constexpr double kRadius_mm = 40.0;

Volume cylinder(double spacing_mm = 1.0) {
    const uint32_t side = 1 + 2 * uint32_t(std::lround(50.0 / spacing_mm));
    const Grid grid = make_grid({side, side, 40}, {spacing_mm, spacing_mm, 3}, {-50, -50, 0});
    return make_volume(grid, ScalarType::u8, [=](glm::uvec3 i) {
        const glm::dvec3 at = world_point(grid, glm::dvec3(i));
        return std::hypot(at.x, at.y) <= kRadius_mm ? 1.0 : 0.0;
    });
}

// Radii at which rays from the middle of each slice leave the object.
std::vector<double> radii(const Volume& labels) {
    std::vector<double> all;
    for (uint32_t z = 0; z < labels.size().z; ++z)
        for (int k = 0; k < 64; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / 64;
            double r = 10.0;
            const auto inside = [&] {
                const glm::dvec3 at =
                    index_point(labels.grid(), {r * std::cos(angle), r * std::sin(angle), 3.0 * z});
                return labels.value(glm::uvec3(glm::round(at))) != 0.0f;
            };
            while (r < 49.0 && inside())
                r += 0.25;
            all.push_back(r);
        }
    return all;
}

// The line is off by the sum of 12 waves of amplitude a = 2 / sqrt(6), whose variance is 4. The
// truth and the result are samples, and the rays have steps of 0.25 mm: each adds a twelfth of its
// square.
//
// The mean over a circle of radius R of a wave of length l is a J0(2 pi R / l) sin(phase), and the
// square of J0(x) is 1 / (pi x) on average: 0.06 for 40 mm and 45 mm, which no 20 .. 60 mm exceeds
// by half. So a slice's mean has the variance 12 a^2 / 2 * 0.06 = 0.24. Phases move by 0.8 from
// slice to slice, which are then correlated by exp(-0.8^2 / 2) = 0.73; 40 of them count as
// 40 (1 - 0.73) / (1 + 0.73) = 6.3. The mean is 0 +- 0.2; three of these, and half a step of a ray,
// are 0.73.
//
// Variances of slices count by the square of the correlation: as 12 slices, and along a circle of
// 251 mm as one in a third of a wave, 19. The variance of 228 draws is 4 +- 0.37, of three of which
// the deviation is off by 0.28.
class OutlineByHand : public ::testing::TestWithParam<double> {};
TEST_P(OutlineByHand, IsOffByItsHabits) {
    const auto outlined = outline_by_hand(cylinder(GetParam()), 3, {.off_sd_mm = 2.0}, {});
    ASSERT_TRUE(outlined);
    double sum = 0.0, squares = 0.0;
    const std::vector<double> all = radii(outlined->labels);
    for (const double r : all) {
        sum += r - kRadius_mm;
        squares += (r - kRadius_mm) * (r - kRadius_mm);
    }
    const double lattice = (2.0 * GetParam() * GetParam() + 0.25 * 0.25) / 12.0;
    EXPECT_NEAR(sum / double(all.size()), 0.0, 0.73);
    EXPECT_NEAR(std::sqrt(squares / double(all.size())), std::sqrt(4.0 + lattice), 0.28);
    // 40 slices, each a circle. A wave that runs along it makes it longer by (pi a / l)^2, one
    // across not: 12 waves, with 1 / l^2 = 1 / 1200 on average, by 3 %. Three times that is
    // allowed.
    EXPECT_EQ(outlined->interaction.clicks, 80u);
    const double circles_mm = 40 * 2 * std::numbers::pi * kRadius_mm;
    EXPECT_NEAR(outlined->interaction.path_mm, circles_mm, 0.1 * circles_mm);
}
INSTANTIATE_TEST_SUITE_P(SpacingMm, OutlineByHand, ::testing::Values(1.0, 2.5));

TEST(Outline, WithoutDeviationIsTheTruth) {
    const Volume truth = cylinder();
    const auto outlined = outline_by_hand(truth, 3, {.off_sd_mm = 0.0}, {});
    ASSERT_TRUE(outlined);
    for (uint32_t y = 0; y < 101; ++y)
        for (uint32_t x = 0; x < 101; ++x)
            ASSERT_EQ(outlined->labels.value({x, y, 7}), truth.value({x, y, 7}));
}

} // namespace
} // namespace palpate::bench
