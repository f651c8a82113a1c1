#pragma once

#include <glm/glm.hpp>

#include "engine/base/tool_pose.h"
#include "haptics/core/device.h"

namespace palpate::haptics {

// How a device's metres become the world's millimetres, and forces the other way.
//
//     position_mm = offset_mm + rotation * (1000 * scale * position_m)
//
// scale is millimetres of the world per millimetre of the hand. A force is turned and not scaled,
// so what is rendered with k newtons a world metre feels like k * scale to the hand.
//
// Scale, rotation and clutch can change at any time: the tool then stays where it is, the offset
// gives way, and neither pose nor force jumps.
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

    // While pressed, the hand moves and the tool stays; when released, it goes on from there.
    // Call it with every sample, before tool().
    void set_clutch(bool pressed, const DeviceSample& sample) noexcept;
    bool clutched() const noexcept { return clutched_; }
    // The tool at `sample` stays where it is. Not while clutched.
    void set_scale(double scale, const DeviceSample& sample) noexcept;

 private:
    void anchor(const ToolPose& tool, const DeviceSample& sample) noexcept;

    double scale_;
    glm::dquat rotation_; // world_from_device
    glm::dvec3 offset_mm_;
    glm::dquat tool_turn_{1.0, 0.0, 0.0, 0.0}; // of the tool in the hand, after clutching
    bool clutched_ = false;
    ToolPose held_;
};

} // namespace palpate::haptics
