#pragma once

#include <glm/glm.hpp>

#include "engine/base/tool_pose.h"
#include "haptics/core/device.h"

namespace palpate::haptics {

// Settings of a workspace that a person changes while it runs.
struct WorkspaceSettings {
    double scale = 1.0;                      // mm of the world per mm of the hand; > 0
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // world_from_device, unit length
    bool clutched = false;

    friend bool operator==(const WorkspaceSettings&, const WorkspaceSettings&) = default;
};

// The rotation by which the hand moves as a view shows it: the device's x axis is the view's right,
// its y axis the view's up, and z comes towards the person. Both of unit length, at right angles.
glm::dquat aligned_with_view(glm::dvec3 right, glm::dvec3 up) noexcept;

// How a device's metres become the world's millimetres, and forces the other way.
//
//     position_mm = offset_mm + rotation * (1000 * scale * position_m)
//
// scale is millimetres of the world per millimetre of the hand. A force is turned and not scaled,
// so a stiffness of k newtons a world metre feels like k * scale to the hand.
//
// Scale, rotation and clutch change while it runs: the tool then stays where it is, the offset
// gives way, and neither pose nor force jumps. Scale and rotation move to new settings at a bounded
// rate, so that what the hand feels does not turn or stiffen at once; the clutch fades the force
// out and in.
class Workspace {
 public:
    // The middle of the device's workspace shows center_mm. scale > 0; rotation (world_from_device)
    // of unit length.
    Workspace(glm::dvec3 center_mm, double scale, glm::dquat rotation = {1.0, 0.0, 0.0, 0.0});

    double scale() const noexcept { return scale_; }
    glm::dquat rotation() const noexcept { return rotation_; } // world_from_device
    glm::dvec3 offset_mm() const noexcept { return offset_mm_; }

    ToolPose tool(const DeviceSample& sample) const noexcept;
    glm::dvec3 velocity_mm_per_s(const DeviceSample& sample) const noexcept; // 0 while clutched
    Wrench to_device(const Wrench& world) const noexcept;

    // The inverse of tool() without clutch: where a device has to be for a tool to be there.
    glm::dvec3 device_position_m(glm::dvec3 tool_mm) const noexcept;

    // Moves towards `wanted`; call it with every sample, before tool(). While clutched, the hand
    // moves and the tool stays; when released, it goes on from there. Settings that are none (see
    // there) leave scale and rotation as they are.
    static constexpr double kScaleRate_per_s = 10.0; // of the scale: 1 % a millisecond
    static constexpr double kTurnRate_rad_per_s = 3.0;
    void follow(const WorkspaceSettings& wanted, const DeviceSample& sample, double dt_s) noexcept;
    bool clutched() const noexcept { return clutched_; }

    // The share of the force: 0 a while after a press of the clutch, 1 a while after its release.
    static constexpr double kClutchOut_s = 0.020, kClutchIn_s = 0.100;
    double force_share() const noexcept { return force_share_; }

 private:
    void set_clutch(bool pressed, const DeviceSample& sample) noexcept;
    void move(double scale, glm::dquat rotation, const DeviceSample& sample) noexcept;
    void anchor(const ToolPose& tool, const DeviceSample& sample) noexcept;

    double scale_;
    glm::dquat rotation_; // world_from_device
    glm::dvec3 offset_mm_;
    glm::dquat tool_turn_{1.0, 0.0, 0.0, 0.0}; // of the tool in the hand, after clutching
    bool clutched_ = false;
    double force_share_ = 1.0;
    ToolPose held_;
};

} // namespace palpate::haptics
