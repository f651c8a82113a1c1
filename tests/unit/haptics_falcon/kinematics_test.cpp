#include "haptics/device/falcon/kinematics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace palpate::haptics::falcon {
namespace {

Angles angles_of(const Counts& counts) {
    return {angle_of_count(counts[0]), angle_of_count(counts[1]), angle_of_count(counts[2])};
}

// Places in the ball that is the workspace, its poles and 2000 of its surface among them.
std::vector<glm::dvec3> places() {
    std::vector<glm::dvec3> all{{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    std::mt19937_64 random(3);
    std::normal_distribution<double> number;
    for (int i = 0; i < 5000; ++i) {
        const glm::dvec3 out =
            glm::normalize(glm::dvec3(number(random), number(random), number(random)));
        all.push_back(i < 2000 ? out : std::cbrt(static_cast<double>(i) / 5000.0) * out);
    }
    for (glm::dvec3& place : all)
        place = glm::dvec3(0, 0, kCentre_m) + kReach_m * place;
    return all;
}

TEST(FalconKinematics, PublishedCountsGiveTheirPositions) {
    const struct {
        Counts counts;
        glm::dvec3 mm;
    } known[] = {{{0, 0, 0}, {0, 0, 134.6024}},
                 {{500, 500, 500}, {0, 0, 156.8605}},
                 {{1000, 1000, 1000}, {0, 0, 173.6032}},
                 {{-500, -500, -500}, {0, 0, 110.7545}},
                 {{300, -200, 100}, {14.5276, -11.5785, 136.1478}},
                 {{-1000, 400, 250}, {-20.0053, 43.3101, 117.2109}}};
    for (const auto& [counts, mm] : known) {
        const std::optional<glm::dvec3> found = forward(angles_of(counts), home());
        ASSERT_TRUE(found);
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(1e3 * (*found)[axis], mm[axis], 1e-4);
    }
}

TEST(FalconKinematics, ForwardUndoesInverseOverTheWorkspace) {
    size_t reached = 0;
    double worst_m = 0.0, worst_error = 0.0;
    for (const glm::dvec3 place : places()) {
        const std::optional<Angles> angles = inverse(place);
        if (!angles)
            continue;
        ++reached;
        worst_error = std::max(worst_error, glm::length(loop_error(*angles, place)));
        for (const glm::dvec3 start : {home(), glm::dvec3(0, 0, kCentre_m)}) {
            const std::optional<glm::dvec3> back = forward(*angles, start);
            ASSERT_TRUE(back) << place.x << ' ' << place.y << ' ' << place.z;
            worst_m = std::max(worst_m, glm::distance(*back, place));
        }
        for (const double angle : *angles)
            EXPECT_LT(std::abs(count_of_angle(angle)), kMostCounts);
    }
    EXPECT_EQ(reached, places().size());
    EXPECT_LT(worst_m, 1e-9);
    EXPECT_LT(worst_error, 0.2 * 1e-12); // a gradient of 0.2 m times a position known to 1e-12 m
}

TEST(FalconKinematics, JacobianIsTheDifferenceOfPositions) {
    for (const glm::dvec3 place : places()) {
        const Angles angles = *inverse(place);
        const std::optional<glm::dmat3> found = jacobian(angles, place);
        ASSERT_TRUE(found);
        constexpr double kStep = 1e-5;
        for (size_t leg = 0; leg < 3; ++leg) {
            Angles more = angles, less = angles;
            more[leg] += kStep;
            less[leg] -= kStep;
            const glm::dvec3 by_difference =
                (*forward(more, place) - *forward(less, place)) / (2.0 * kStep);
            // Central differences err by step^2 times the third derivative, which grows as the
            // legs stretch: 1e-10 times at most 1e3 m here, with positions known to 1e-12 / 1e-5.
            EXPECT_LT(glm::distance((*found)[static_cast<int>(leg)], by_difference),
                      2e-6 * (1.0 + glm::length(by_difference)));
        }
    }
}

TEST(FalconKinematics, TorquesDoTheWorkOfTheForce) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> number;
    for (const glm::dvec3 place : places()) {
        const Angles angles = *inverse(place);
        const glm::dmat3 by_angle = *jacobian(angles, place);
        const glm::dvec3 force(number(random), number(random), number(random));
        const glm::dvec3 torque = glm::transpose(by_angle) * force;
        // A small turn of each arm, and where the loop equations say that the grip goes.
        const glm::dvec3 turn = 1e-6 * glm::dvec3(number(random), number(random), number(random));
        const Angles turned{angles[0] + turn.x, angles[1] + turn.y, angles[2] + turn.z};
        const glm::dvec3 way = *forward(turned, place) - place;
        const double size = glm::length(force) * glm::length(way) + 1e-12;
        EXPECT_NEAR(glm::dot(torque, turn), glm::dot(force, way), 1e-3 * size);
    }
}

// The published figure: 1 N along x at z = 0.15 m needs up to 70.9 mN m.
TEST(FalconKinematics, TorqueOfANewton) {
    const glm::dvec3 place(0, 0, 0.15);
    const glm::dvec3 torque =
        glm::transpose(*jacobian(*inverse(place), place)) * glm::dvec3(1, 0, 0);
    EXPECT_NEAR(std::max({std::abs(torque.x), std::abs(torque.y), std::abs(torque.z)}), 0.0709,
                5e-5);
}

// The force in the direction that is worst for a motor: its share of torque a newton is as large as
// its column of the Jacobian.
TEST(FalconKinematics, TheForceNamedIsThereInEveryDirection) {
    double least_n = 1e9;
    for (const glm::dvec3 place : places()) {
        const glm::dmat3 by_angle = *jacobian(*inverse(place), place);
        for (int leg = 0; leg < 3; ++leg)
            least_n = std::min(least_n, 0.4096 / glm::length(by_angle[leg]));
    }
    EXPECT_GE(least_n, kForce_n);
    EXPECT_LT(least_n, 1.05 * kForce_n);
}

TEST(FalconKinematics, WhatCannotBeIsNoPlace) {
    EXPECT_FALSE(inverse({0, 0, 1.0}));
    EXPECT_FALSE(inverse({0.5, 0, 0.15}));
    EXPECT_FALSE(inverse({NAN, 0, 0.15}));
    for (const double wrong : {double(NAN), double(INFINITY), 1e9})
        EXPECT_FALSE(forward({wrong == 1e9 ? angle_of_count(32767) : wrong, angle_of_count(-32768),
                              angle_of_count(0)},
                             home()));
    // Whatever the counts: an answer that fulfils the equations, or none.
    std::mt19937_64 random(7);
    for (int i = 0; i < 100'000; ++i) {
        const Angles angles =
            angles_of({static_cast<int16_t>(random()), static_cast<int16_t>(random()),
                       static_cast<int16_t>(random())});
        if (const std::optional<glm::dvec3> place = forward(angles, home())) {
            EXPECT_LT(glm::length(loop_error(angles, *place)), 1e-12);
        }
    }
}

} // namespace
} // namespace palpate::haptics::falcon
