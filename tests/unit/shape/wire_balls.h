#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "engine/segment/live_wire_surface.h"
#include "engine/segment/wire_curves.h"
#include "engine/volume/builder.h"
#include "engine/volume/grid.h"

// Balls of one value in another, with a sharp or a blurred edge, about which three great circles of
// 24 points each are drawn; 36 of them.
namespace palpate::wire_balls {

constexpr int kBalls = 36;

// Dice of what live-wires from point to point enclose.
inline double dice_of(int number) {
    const double radius_mm = std::array{8.0, 12.0, 17.0}[size_t(number / 12)];
    const glm::dvec3 spacing = std::array{glm::dvec3(0.9, 1.0, 1.1), glm::dvec3(1.0, 1.0, 2.5),
                                          glm::dvec3(0.7, 0.9, 1.5)}[size_t(number / 4 % 3)];
    const bool is_sharp = number % 4 < 2, is_turned = number % 2 == 1;
    std::mt19937 random(uint32_t(number + 1));
    const auto between = [&](double low, double high) {
        return low + (high - low) * double(random()) / 4294967296.0;
    };
    const glm::uvec3 size(glm::ceil(glm::dvec3(2.0 * radius_mm + 20.0) / spacing));
    const Grid grid = make_grid(size, spacing, -0.5 * spacing * (glm::dvec3(size) - 1.0));
    const glm::dvec3 middle(between(-1, 1), between(-1, 1), between(-1, 1));
    const auto away = [&](glm::uvec3 i) {
        return glm::distance(world_point(grid, glm::dvec3(i)), middle) - radius_mm;
    };
    const Volume ball = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        const double d = away(i);
        return is_sharp ? (d < 0.0 ? 500.0 : 0.0) : 250.0 * std::erfc(d / std::sqrt(2.0));
    });
    const double a = is_turned ? between(0, 3) : 0.0, b = is_turned ? between(0, 3) : 0.0;
    const glm::dmat3 turn =
        glm::dmat3(std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a), 0, 0, 0, 1) *
        glm::dmat3(1, 0, 0, 0, std::cos(b), std::sin(b), 0, -std::sin(b), std::cos(b));
    std::vector<WireCurve> curves;
    for (int axis = 0; axis < 3; ++axis) {
        WireCurve circle;
        for (int i = 0; i <= 24; ++i) {
            const double angle = double(i % 24) * M_PI / 12.0;
            glm::dvec3 p(0.0);
            p[(axis + 1) % 3] = radius_mm * std::cos(angle);
            p[(axis + 2) % 3] = radius_mm * std::sin(angle);
            circle.points_mm.push_back(middle + turn * p);
        }
        const Result<WireCurve> along = along_edges(ball, circle, {}, {});
        EXPECT_TRUE(along) << along.error().message;
        curves.push_back(*along);
    }
    const Result<LiveWireSurface> made = live_wire_surface(grid, curves, {});
    EXPECT_TRUE(made) << made.error().message;
    double both = 0.0, sum = 0.0;
    for (uint32_t z = 0; made && z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const bool wanted = away({x, y, z}) < 0.0;
                const bool found = made->labels.value({x, y, z}) > 0.0f;
                both += wanted && found, sum += double(wanted) + double(found);
            }
    return 2.0 * both / sum;
}

} // namespace palpate::wire_balls
