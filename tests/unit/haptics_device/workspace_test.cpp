#include "haptics/core/workspace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace palpate::haptics {
namespace {

DeviceSample at(glm::dvec3 position_m, glm::dquat rotation = {1.0, 0.0, 0.0, 0.0}) {
    return {.position_m = position_m, .rotation = rotation};
}

// A quarter turn about z, exact enough: x goes to y.
const glm::dquat kTurn = glm::normalize(glm::dquat(1.0, 0.0, 0.0, 1.0));

void expect_near(glm::dvec3 a, glm::dvec3 b, double tolerance) {
    EXPECT_LE(glm::length(a - b), tolerance)
        << a.x << ' ' << a.y << ' ' << a.z << " beside " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Workspace, TurnsScalesAndPlacesPositionsButOnlyTurnsForces) {
    const Workspace workspace({10, 20, 30}, 2.0, kTurn);
    // Rounding of values up to 100 mm: far below 1e-12 mm.
    expect_near(workspace.tool(at({0.01, 0, 0})).position_mm, {10, 40, 30}, 1e-12);
    expect_near(workspace.velocity_mm_per_s({.velocity_m_per_s = {0.1, 0, 0}}), {0, 200, 0}, 1e-12);
    const Wrench wrench = workspace.to_device({{0, 3, 0}, {0, 0, 1}});
    expect_near(wrench.force_n, {3, 0, 0}, 1e-14);
    expect_near(wrench.torque_nm, {0, 0, 1}, 1e-14);
}

TEST(Workspace, WorkDoneInWorldIsScaleTimesWorkOfTheHand) {
    // This makes a scaled spring feel scale times as stiff, and energy accounts consistent.
    const Workspace workspace({0, 0, 0}, 3.0, kTurn);
    const glm::dvec3 step_m(0.001, -0.002, 0.0005), force_n(1, 2, 3);
    const glm::dvec3 step_mm =
        workspace.tool(at(step_m)).position_mm - workspace.tool(at({0, 0, 0})).position_mm;
    const double world_mj = glm::dot(force_n, step_mm); // N mm = mJ
    const double hand_mj = 1000 * glm::dot(workspace.to_device({force_n, {}}).force_n, step_m);
    EXPECT_NEAR(world_mj, 3.0 * hand_mj, 1e-12);
}

TEST(Workspace, DevicePositionIsTheInverseOfTool) {
    const Workspace workspace({-5, 7, 11}, 0.5, glm::normalize(glm::dquat(1, 2, 3, 4)));
    const glm::dvec3 tool = workspace.tool(at({0.03, -0.02, 0.01})).position_mm;
    expect_near(workspace.device_position_m(tool), {0.03, -0.02, 0.01}, 1e-15);
}

TEST(Workspace, ClutchHoldsTheToolWhileTheHandMovesBack) {
    Workspace workspace({0, 0, 0}, 1.0, kTurn);
    const DeviceSample far = at({0.04, 0, 0});
    const ToolPose before = workspace.tool(far);
    workspace.follow({.rotation = kTurn, .clutched = true}, far, 1e-3);
    for (const double x : {0.04, 0.02, 0.0, -0.04}) {
        const DeviceSample moved = at({x, 0.01, 0}, kTurn);
        workspace.follow({.rotation = kTurn, .clutched = true}, moved, 1e-3);
        EXPECT_EQ(workspace.tool(moved).position_mm, before.position_mm);
        EXPECT_EQ(workspace.tool(moved).rotation, before.rotation);
        EXPECT_EQ(workspace.velocity_mm_per_s({.velocity_m_per_s = {1, 1, 1}}), glm::dvec3(0));
    }
    const DeviceSample back = at({-0.04, 0.01, 0}, kTurn);
    workspace.follow({.rotation = kTurn}, back, 1e-3);
    const ToolPose after = workspace.tool(back);
    expect_near(after.position_mm, before.position_mm, 1e-12);
    EXPECT_NEAR(std::abs(glm::dot(after.rotation, before.rotation)), 1.0, 1e-14);
    // And it goes on as before from there.
    const glm::dvec3 on = workspace.tool(at({-0.03, 0.01, 0}, kTurn)).position_mm;
    expect_near(on - after.position_mm, {0, 10, 0}, 1e-12);
}

TEST(Workspace, AnotherScaleAndTurnAreReachedSlowlyAndLeaveTheToolWhereItIs) {
    for (const double scale : {4.0, 1.0, 0.25}) {
        for (const bool clutched : {false, true}) {
            Workspace workspace({1, 2, 3}, 1.0);
            const DeviceSample sample = at({0.03, -0.01, 0.02}, kTurn);
            const ToolPose before = workspace.tool(sample);
            const WorkspaceSettings wanted{scale, kTurn, clutched};
            int ms = 0;
            while (workspace.scale() != scale || workspace.rotation() != kTurn) {
                const double was = workspace.scale();
                const glm::dquat turn = workspace.rotation();
                workspace.follow(wanted, sample, 1e-3);
                ASSERT_LE(std::abs(workspace.scale() / was - 1.0), 0.01 + 1e-12);
                // acos near 1 keeps half of the digits.
                ASSERT_LE(2.0 * std::acos(std::min(1.0, glm::dot(turn, workspace.rotation()))),
                          0.003 + 1e-7);
                expect_near(workspace.tool(sample).position_mm, before.position_mm, 1e-10);
                ASSERT_NEAR(std::abs(glm::dot(workspace.tool(sample).rotation, before.rotation)),
                            1.0, 1e-12);
                ASSERT_LT(++ms, 1000);
            }
            EXPECT_NEAR(ms, 524, 1); // a quarter turn at 3 rad/s; the scale takes less
            workspace.follow({scale, kTurn}, sample, 1e-3);
            expect_near(workspace.tool(sample).position_mm, before.position_mm, 1e-10);
            // From here on the hand moves as it was asked for: x goes to y.
            const glm::dvec3 on = workspace.tool(at({0.034, -0.01, 0.02}, kTurn)).position_mm;
            expect_near(on - before.position_mm, {0, 4 * scale, 0}, 1e-10);
        }
    }
}

TEST(Workspace, SettingsThatAreNoneChangeNothing) {
    Workspace workspace({1, 2, 3}, 2.0);
    const DeviceSample sample = at({0.01, 0, 0});
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const WorkspaceSettings& none :
         {WorkspaceSettings{.scale = 0.0}, WorkspaceSettings{.scale = -1.0},
          WorkspaceSettings{.scale = nan}, WorkspaceSettings{.rotation = {2, 0, 0, 0}},
          WorkspaceSettings{.rotation = {nan, 0, 0, 0}}}) {
        workspace.follow(none, sample, 1e-3);
        EXPECT_EQ(workspace.scale(), 2.0);
        EXPECT_EQ(workspace.rotation(), glm::dquat(1, 0, 0, 0));
    }
}

TEST(Workspace, TheClutchFadesForceOutAndIn) {
    Workspace workspace({0, 0, 0}, 1.0);
    EXPECT_EQ(workspace.force_share(), 1.0);
    for (int ms = 1; ms <= 30; ++ms) {
        workspace.follow({.clutched = true}, at({0, 0, 0}), 1e-3);
        EXPECT_NEAR(workspace.force_share(), std::max(0.0, 1.0 - ms / 20.0), 1e-12);
    }
    for (int ms = 1; ms <= 120; ++ms) {
        workspace.follow({}, at({0, 0, 0}), 1e-3);
        EXPECT_NEAR(workspace.force_share(), std::min(1.0, ms / 100.0), 1e-12);
    }
}

TEST(Workspace, InAViewTheHandMovesAsThePictureShowsIt) {
    // Looking along +y of the patient, from the front, head up: right in the picture is +x.
    const Workspace workspace({0, 0, 0}, 1.0, aligned_with_view({1, 0, 0}, {0, 0, 1}));
    expect_near(workspace.tool(at({0.01, 0, 0})).position_mm, {10, 0, 0}, 1e-12);
    expect_near(workspace.tool(at({0, 0.01, 0})).position_mm, {0, 0, 10}, 1e-12);
    expect_near(workspace.tool(at({0, 0, 0.01})).position_mm, {0, -10, 0}, 1e-12); // to the person
    expect_near(workspace.to_device({{0, -1, 0}, {}}).force_n, {0, 0, 1}, 1e-12);
}

} // namespace
} // namespace palpate::haptics
