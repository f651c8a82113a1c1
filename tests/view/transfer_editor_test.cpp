// The transfer function editor.

#include "apps/view/panels/transfer_editor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace palpate::view {
namespace {

TransferFunction example() {
    return {{{0.0, {0, 0, 0}}, {100.0, {1, 0, 0}}, {400.0, {1, 1, 1}}},
            {{50.0, 0.0}, {200.0, 0.5}, {300.0, 0.9}},
            1.0};
}

const TransferPlot kPlot{{{10, 20}, {201, 101}}, {{10, 123}, {201, 14}}, -100.0, 500.0};

TEST(TransferEditor, PixelsAndValuesAreInverse) {
    EXPECT_EQ(kPlot.value_at(10), -100.0);
    EXPECT_EQ(kPlot.value_at(210), 500.0);
    EXPECT_EQ(kPlot.opacity_at(20), 1.0);
    EXPECT_EQ(kPlot.opacity_at(120), 0.0);
    EXPECT_EQ(kPlot.opacity_at(500), 0.0);
    for (const double value : {-100.0, 13.0, 499.0})
        EXPECT_NEAR(kPlot.value_at(kPlot.x_of(value)), value, 1e-9);
    for (const double opacity : {0.0, 0.3, 1.0})
        EXPECT_NEAR(kPlot.opacity_at(kPlot.y_of(opacity)), opacity, 1e-12);
}

TEST(TransferEditor, ThePointerFindsTheNearestPointWithinReach) {
    const TransferFunction function = example();
    const auto at = [&](double value, double opacity) {
        return glm::dvec2(kPlot.x_of(value), kPlot.y_of(opacity));
    };
    const auto under = [&](glm::dvec2 px) { return point_under(kPlot, function, {250.0}, px); };
    EXPECT_EQ(under(at(200, 0.5) + glm::dvec2(3, -4)),
              (TransferPoint{TransferPoint::Of::opacity, 1}));
    EXPECT_FALSE(under(at(200, 0.5) + glm::dvec2(6, -6)));
    EXPECT_EQ(under({kPlot.x_of(250.0), 22}), (TransferPoint{TransferPoint::Of::iso, 0}));
    EXPECT_FALSE(under({kPlot.x_of(250.0), 60})); // below its grip
    EXPECT_EQ(under({kPlot.x_of(100.0) + 2, 130}), (TransferPoint{TransferPoint::Of::color, 1}));
}

TEST(TransferEditor, AddingAColourChangesNoColour) {
    TransferFunction function = example();
    const size_t added = add_color(function, 250.0);
    EXPECT_EQ(added, 2u);
    for (double v = -50.0; v < 450.0; v += 7.0)
        EXPECT_LT(glm::distance(color_at(function, v), color_at(example(), v)), 1e-12);
}

// Whatever a hand does, points stay in order and opacities within 0 .. 1.
TEST(TransferEditor, AnyEditsKeepAFunction) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> value(-500.0, 900.0), opacity(-1.0, 2.0);
    TransferFunction function = example();
    for (int i = 0; i < 5000; ++i) {
        const size_t o = random() % function.opacities.size(),
                     c = random() % function.colors.size();
        switch (random() % 6) {
            case 0:
                add_opacity(function, value(random), opacity(random));
                break;
            case 1:
                add_color(function, value(random));
                break;
            case 2:
                move_opacity(function, o, value(random), opacity(random));
                break;
            case 3:
                move_color(function, c, value(random));
                break;
            case 4:
                remove_point(function, {TransferPoint::Of::opacity, o});
                break;
            case 5:
                remove_point(function, {TransferPoint::Of::color, c});
                break;
        }
        const auto rises = [](const auto& points) {
            return std::is_sorted(points.begin(), points.end(),
                                  [](const auto& a, const auto& b) { return a.value < b.value; });
        };
        ASSERT_FALSE(function.opacities.empty() || function.colors.empty());
        ASSERT_TRUE(rises(function.opacities) && rises(function.colors));
        for (const auto& point : function.opacities)
            ASSERT_TRUE(point.opacity >= 0.0 && point.opacity <= 1.0);
    }
    while (remove_point(function, {TransferPoint::Of::opacity, 0}))
        ;
    EXPECT_EQ(function.opacities.size(), 1u);
}

} // namespace
} // namespace palpate::view
