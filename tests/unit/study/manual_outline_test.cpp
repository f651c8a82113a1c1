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

// The line is off by the wave; the lattice adds the variance of a sample, 1/12, and of the rays'
// steps.
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
    EXPECT_NEAR(sum / double(all.size()), 0.0, 0.7);
    EXPECT_NEAR(std::sqrt(squares / double(all.size())), 2.0, 0.5);
    // 40 slices, each a circle.
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
