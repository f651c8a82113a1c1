#include "engine/volume/extent.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

namespace palpate {
namespace {

using testing::HasSubstr;

Grid turned(glm::uvec3 size, glm::dvec3 spacing, double angle, glm::dvec3 axis, glm::dvec3 origin) {
    Grid grid = make_grid(size, spacing);
    const glm::dmat4 turn = glm::rotate(glm::dmat4(1.0), angle, glm::normalize(axis));
    grid.world_from_index = glm::translate(glm::dmat4(1.0), origin) * turn * grid.world_from_index;
    return grid;
}

// Half spaces of a grid hold a point if and only if its index lies within the samples.
TEST(Extent, HalfSpacesOfAGridAreItsSamples) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    for (int i = 0; i < 200; ++i) {
        const Grid grid = turned({5, 7, 3}, {0.5, 2.0, 3.0}, 3.0 * any(random),
                                 {any(random), any(random), 1.1}, {any(random), 40.0, -9.0});
        const glm::dvec3 index = (glm::dvec3(grid.size) - 1.0) *
                                 (0.5 + 0.8 * glm::dvec3(any(random), any(random), any(random)));
        const glm::dvec3 point = world_point(grid, index);
        bool in_all = true;
        for (const HalfSpace& space : half_spaces(grid))
            in_all = in_all && glm::dot(space.normal, point) >= space.offset;
        const bool inside = glm::all(glm::greaterThanEqual(index, glm::dvec3(0.0))) &&
                            glm::all(glm::lessThanEqual(index, glm::dvec3(grid.size) - 1.0));
        EXPECT_EQ(in_all, inside) << i;
    }
}

// Two boxes meet where a sample point of one lies in the other; they do not where a plane parts
// them. Between those, which leave no case out of these, is what corners decide.
TEST(Extent, BoxesMeetUnlessAPlaneIsBetweenThem) {
    const Grid a = make_grid({11, 11, 11}, glm::dvec3(1.0)); // 0 .. 10 mm
    const auto meet = [&](const Grid& b) {
        std::vector<HalfSpace> both = half_spaces(a);
        const std::vector<HalfSpace> others = half_spaces(b);
        both.insert(both.end(), others.begin(), others.end());
        return have_common_point(both, slack_mm(a));
    };
    EXPECT_TRUE(meet(a));
    EXPECT_TRUE(meet(make_grid({2, 2, 2}, glm::dvec3(1.0), glm::dvec3(4.5))));  // within
    EXPECT_TRUE(meet(make_grid({2, 2, 2}, glm::dvec3(1.0), glm::dvec3(10.0)))); // at a corner
    EXPECT_FALSE(meet(make_grid({2, 2, 2}, glm::dvec3(1.0), glm::dvec3(10.01, 0, 0))));
    // A bar across an edge: its box along the axes overlaps, the bar itself passes beside.
    const double eighth = 0.25 * 3.14159265358979;
    EXPECT_TRUE(meet(turned({41, 1, 1}, glm::dvec3(1.0), eighth, {0, 0, 1}, {-10, -18, 5})));
    EXPECT_FALSE(meet(turned({41, 1, 1}, glm::dvec3(1.0), eighth, {0, 0, 1}, {-6, -18, 5})));
    // One sample is a point; many far from the origin keep their place.
    EXPECT_TRUE(meet(make_grid({1, 1, 1}, glm::dvec3(1.0), glm::dvec3(10, 0, 10))));
    EXPECT_FALSE(meet(make_grid({1, 1, 1}, glm::dvec3(1.0), glm::dvec3(10, -0.1, 10))));
    const glm::dvec3 far(1e6, -1e6, 1e6);
    Grid away = a;
    away.world_from_index[3] += glm::dvec4(far, 0.0);
    std::vector<HalfSpace> both = half_spaces(away);
    both.push_back({{1, 0, 0}, 1e6 + 9.99});
    EXPECT_TRUE(have_common_point(both, slack_mm(a)));
    both.back().offset = 1e6 + 10.01;
    EXPECT_FALSE(have_common_point(both, slack_mm(a)));
}

TEST(Extent, NamesBothPlacesInThePatient) {
    const Grid volume = make_grid({11, 21, 5}, {1, 1, 2}, {-5, 0, 100});
    EXPECT_EQ(text_of(world_box(volume)),
              "left -5 .. 5, posterior 0 .. 20, superior 100 .. 108 mm");
    EXPECT_EQ(apart_text("the label map", volume, volume), "");
    Grid moved = volume;
    moved.world_from_index[3].x += 500.0;
    EXPECT_THAT(apart_text("the label map", moved, volume),
                HasSubstr("the label map lies outside the volume: it is within left 495 .. 505, "));
    // Labels fill their cells: half a sample beyond their centres.
    moved.world_from_index[3].x = 5.0 + 0.49;
    EXPECT_EQ(apart_text("the label map", moved, volume), "");
    moved.world_from_index[3].x = 5.0 + 0.51;
    EXPECT_NE(apart_text("the label map", moved, volume), "");
}

} // namespace
} // namespace palpate
