#include "engine/reference/cubic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/reference/quadrature.h"
#include "engine/volume/builder.h"
#include "engine/volume/sample.h"

namespace palpate::reference {
namespace {

TEST(Cubic, IsTheTrilinearInterpolantAlongALine) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int round = 0; round < 100; ++round) {
        std::array<float, 8> values;
        for (float& value : values)
            value = static_cast<float>(2000.0 * unit(random) - 1000.0);
        const Volume cell = make_volume<float>(make_grid({2, 2, 2}, {1, 1, 1}), values);
        const glm::dvec3 a(unit(random), unit(random), unit(random));
        const glm::dvec3 b(unit(random), unit(random), unit(random));
        const Cubic cubic = cell_cubic(cell_corners(cell, {0, 0, 0}), a, b);
        for (double u = 0.0; u <= 1.0; u += 0.125) // values to 1000, some ten roundings
            EXPECT_NEAR(cubic(u), trilinear(cell, glm::mix(a, b, u)), 1e-10);
    }
}

TEST(Cubic, PiecesAreMonotoneAndRootsAreFound) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> spread(-1.0, 1.0);
    for (int round = 0; round < 2000; ++round) {
        Cubic cubic;
        for (double& c : cubic.c)
            c = spread(random);
        if (round % 4 == 0)
            cubic.c[3] = 0.0;
        if (round % 8 == 0)
            cubic.c[2] = 0.0;
        const MonotonePieces pieces = monotone_pieces(cubic);
        ASSERT_EQ(pieces.ends[0], 0.0);
        ASSERT_EQ(pieces.ends[pieces.count], 1.0);
        for (int m = 0; m < pieces.count; ++m) {
            const double a = pieces.ends[m], b = pieces.ends[m + 1];
            ASSERT_LT(a, b);
            const bool rising = cubic(b) > cubic(a);
            for (int i = 0; i < 16; ++i) {
                const double step = (b - a) / 16.0;
                const double change = cubic(a + (i + 1) * step) - cubic(a + i * step);
                EXPECT_GE(rising ? change : -change, -1e-15);
            }
            const double value = 0.3 * cubic(a) + 0.7 * cubic(b);
            const double root = root_between(cubic, value, a, b);
            EXPECT_GE(root, a);
            EXPECT_LE(root, b);
            EXPECT_NEAR(cubic(root), value, 1e-15); // values to 4: two units in the last place
        }
    }
}

TEST(Cubic, RootBesideTheBracketIsItsNearerEnd) {
    const Cubic line{{0.0, 1.0, 0.0, 0.0}};
    EXPECT_EQ(root_between(line, 1.5, 0.0, 1.0), 1.0);
    EXPECT_EQ(root_between(line, -0.5, 0.0, 1.0), 0.0);
    EXPECT_EQ(root_between(line, 0.0, 0.0, 1.0), 0.0);
}

TEST(Quadrature, IntegratesPolynomialsExactly) {
    const Quadrature& q = gauss_legendre();
    for (int power = 0; power < 2 * kNodes; ++power) {
        double sum = 0.0;
        for (int i = 0; i < kNodes; ++i)
            sum += q.weights[i] * std::pow(q.nodes[i], power);
        EXPECT_NEAR(sum, power % 2 == 0 ? 2.0 / (power + 1) : 0.0, 1e-14) << power;
    }
    for (int power = 0; power < kNodes; ++power)
        for (int i = 0; i < kNodes; ++i) {
            double sum = 0.0;
            for (int j = 0; j < kNodes; ++j)
                sum += q.partial[i][j] * std::pow(q.nodes[j], power);
            const double expected =
                (std::pow(q.nodes[i], power + 1) - std::pow(-1.0, power + 1)) / (power + 1);
            EXPECT_NEAR(sum, expected, 1e-14);
        }
}

TEST(Quadrature, EmissionOfAConstantMediumIsBeersLaw) {
    const auto medium = [](double) { return glm::dvec4(0.5, 1.0, 0.0, 3.0); };
    const Emission seen = integrate(medium, 1.0, 3.0, 1e-13, 12);
    EXPECT_NEAR(seen.depth, 6.0, 1e-13);
    EXPECT_NEAR(seen.color.x, -0.5 * std::expm1(-6.0), 1e-13);
    EXPECT_NEAR(seen.color.y, -std::expm1(-6.0), 1e-13);
}

} // namespace
} // namespace palpate::reference
