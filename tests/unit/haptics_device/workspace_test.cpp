#include "haptics/core/workspace.h"

#include <gtest/gtest.h>

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
    // What makes a scaled spring feel scale times as stiff, and energy accounts consistent.
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
    workspace.set_clutch(true, far);
    for (const double x : {0.04, 0.02, 0.0, -0.04}) {
        const DeviceSample moved = at({x, 0.01, 0}, kTurn);
        workspace.set_clutch(true, moved);
        EXPECT_EQ(workspace.tool(moved).position_mm, before.position_mm);
        EXPECT_EQ(workspace.tool(moved).rotation, before.rotation);
        EXPECT_EQ(workspace.velocity_mm_per_s({.velocity_m_per_s = {1, 1, 1}}), glm::dvec3(0));
    }
    const DeviceSample back = at({-0.04, 0.01, 0}, kTurn);
    workspace.set_clutch(false, back);
    const ToolPose after = workspace.tool(back);
    expect_near(after.position_mm, before.position_mm, 1e-12);
    EXPECT_NEAR(std::abs(glm::dot(after.rotation, before.rotation)), 1.0, 1e-14);
    // And it goes on as before from there.
    const glm::dvec3 on = workspace.tool(at({-0.03, 0.01, 0}, kTurn)).position_mm;
    expect_near(on - after.position_mm, {0, 10, 0}, 1e-12);
}

TEST(Workspace, AnotherScaleLeavesTheToolWhereItIs) {
    Workspace workspace({1, 2, 3}, 1.0);
    const DeviceSample sample = at({0.03, -0.01, 0.02});
    const ToolPose before = workspace.tool(sample);
    workspace.set_scale(0.25, sample);
    expect_near(workspace.tool(sample).position_mm, before.position_mm, 1e-12);
    const glm::dvec3 on = workspace.tool(at({0.034, -0.01, 0.02})).position_mm;
    expect_near(on - before.position_mm, {1, 0, 0}, 1e-12);
}

} // namespace
} // namespace palpate::haptics
