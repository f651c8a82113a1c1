#include "engine/scene/transfer_function.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

const TransferFunction kStep{{{0.0, {0, 0, 0}}, {10.0, {1, 0.5, 0}}},
                             {{0.0, 0.0}, {4.0, 0.5}, {4.0, 0.25}, {10.0, 1.0}},
                             2.0};

TEST(TransferFunction, IsLinearBetweenPointsAndConstantBeyond) {
    EXPECT_EQ(color_at(kStep, -5.0), glm::dvec3(0));
    EXPECT_EQ(color_at(kStep, 5.0), glm::dvec3(0.5, 0.25, 0));
    EXPECT_EQ(color_at(kStep, 50.0), glm::dvec3(1, 0.5, 0));
    EXPECT_EQ(opacity_at(kStep, 2.0), 0.25);
    EXPECT_EQ(opacity_at(kStep, 4.0), 0.25) << "the upper side of a step counts";
    EXPECT_DOUBLE_EQ(tau_per_mm_at(kStep, 4.0), -std::log(0.75) / 2.0);
    EXPECT_TRUE(std::isfinite(tau_per_mm_at(kStep, 10.0))) << "opacity 1 is capped";
    EXPECT_EQ(knots(kStep), (std::vector<double>{0.0, 4.0, 10.0}));
}

TEST(TransferFunction, TableHoldsTheFunctionAtItsEntries) {
    const TransferTable table = make_table(kStep, 101);
    EXPECT_EQ(table.low, 0.0);
    EXPECT_EQ(table.high, 10.0);
    for (size_t i = 0; i < 101; ++i) {
        const double value = 10.0 * static_cast<double>(i) / 100.0;
        EXPECT_FLOAT_EQ(table.entries[i].w, static_cast<float>(tau_per_mm_at(kStep, value)));
        EXPECT_FLOAT_EQ(table.entries[i].x, static_cast<float>(value / 10.0));
    }
}

TEST(TransferFunction, IntegralsAreThoseOfTheFunction) {
    // For opacity a + b v, the integral of -ln(1 - a - b v) is (1 - o) (ln(1 - o) - 1) / b between
    // the opacities o at both ends.
    const auto piece = [](double from, double to, double slope) {
        const auto primitive = [](double o) { return (1.0 - o) * (std::log1p(-o) - 1.0); };
        return (primitive(to) - primitive(from)) / slope;
    };
    const TransferFunction function{
        {{0.0, glm::dvec3(1)}}, {{0.0, 0.0}, {4.0, 0.5}, {4.0, 0.25}, {10.0, 0.85}}, 2.0};
    const TransferTable table = make_table(function, 101);
    // Entries are fp32: relative 2^-24 = 6e-8.
    EXPECT_NEAR(table.integrals[40].w, piece(0.0, 0.5, 0.125) / 2.0 / 10.0, 1e-7);
    EXPECT_NEAR(table.integrals[100].w,
                (piece(0.0, 0.5, 0.125) + piece(0.25, 0.85, 0.1)) / 2.0 / 10.0, 1e-7);
    EXPECT_EQ(table.integrals[100].x, table.integrals[100].w) << "white: tau * 1";
}

TEST(TransferFunction, OneValueEverywhereStillMakesATable) {
    const TransferFunction function{{{7.0, glm::dvec3(0.5)}}, {{7.0, 0.5}}, 1.0};
    const TransferTable table = make_table(function);
    EXPECT_LT(table.low, table.high);
    for (const glm::vec4& entry : table.entries)
        EXPECT_EQ(entry, table.entries[0]);
}

} // namespace
} // namespace palpate
