#include "haptics/proxy/planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace palpate::touch {
namespace {

using glm::dvec3;

TEST(Planes, ProjectionIsTheNearestOfAllSubsets) {
    std::mt19937_64 random(1);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
    int active_three = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        std::vector<haptics::Plane> planes(1 + static_cast<size_t>(trial) % 9);
        for (haptics::Plane& plane : planes) // the origin is free, so there is an answer
            plane = {glm::normalize(dvec3(unit(), unit(), unit())), -std::abs(unit())};
        const dvec3 goal = 3.0 * dvec3(unit(), unit(), unit());
        const haptics::Projection found = project_to_planes(goal, planes);
        ASSERT_TRUE(found.is_feasible);
        active_three += found.active_count == 3;
        for (const haptics::Plane& plane : planes)
            ASSERT_GE(glm::dot(plane.normal, found.point), plane.offset - 1e-8);
        // Every feasible corner, edge and face of up to three planes, by Cramer's rule.
        double best = INFINITY;
        const auto offer = [&](dvec3 p) {
            for (const haptics::Plane& plane : planes)
                if (glm::dot(plane.normal, p) < plane.offset - 1e-7)
                    return;
            best = std::min(best, glm::distance(p, goal));
        };
        offer(goal);
        for (const auto& a : planes) {
            offer(goal - (glm::dot(a.normal, goal) - a.offset) * a.normal);
            for (const auto& b : planes) {
                const dvec3 line = glm::cross(a.normal, b.normal);
                if (glm::length(line) < 1e-6)
                    continue;
                const glm::dmat3 m = glm::transpose(glm::dmat3(a.normal, b.normal, line));
                offer(glm::inverse(m) * dvec3(a.offset, b.offset, glm::dot(line, goal)));
                for (const auto& c : planes)
                    if (std::abs(glm::dot(line, c.normal)) > 1e-5)
                        offer(
                            glm::inverse(glm::transpose(glm::dmat3(a.normal, b.normal, c.normal))) *
                            dvec3(a.offset, b.offset, c.offset));
            }
        }
        ASSERT_NEAR(glm::distance(found.point, goal), best, 1e-6) << trial;
    }
    EXPECT_GT(active_three, 50);
}

TEST(Planes, SaysWhenNothingIsFree) {
    const std::vector<haptics::Plane> planes{{{1, 0, 0}, 1.0}, {{-1, 0, 0}, 1.0}};
    EXPECT_FALSE(project_to_planes(dvec3(0.0), planes).is_feasible);
}

} // namespace
} // namespace palpate::touch
