#include "haptics/core/workspace.h"

#include "engine/base/assert.h"

namespace palpate::haptics {

namespace {

constexpr double kMmPerM = 1000.0;

} // namespace

Workspace::Workspace(glm::dvec3 center_mm, double scale, glm::dquat rotation)
    : scale_(scale), rotation_(rotation), offset_mm_(center_mm) {
    PALPATE_ASSERT(scale > 0.0);
}

ToolPose Workspace::tool(const DeviceSample& sample) const noexcept {
    if (clutched_)
        return held_;
    return {offset_mm_ + rotation_ * (kMmPerM * scale_ * sample.position_m),
            rotation_ * sample.rotation * tool_turn_};
}

glm::dvec3 Workspace::velocity_mm_per_s(const DeviceSample& sample) const noexcept {
    return clutched_ ? glm::dvec3(0.0) : rotation_ * (kMmPerM * scale_ * sample.velocity_m_per_s);
}

Wrench Workspace::to_device(const Wrench& world) const noexcept {
    const glm::dquat device_from_world = glm::conjugate(rotation_);
    return {device_from_world * world.force_n, device_from_world * world.torque_nm};
}

glm::dvec3 Workspace::device_position_m(glm::dvec3 tool_mm) const noexcept {
    return glm::conjugate(rotation_) * (tool_mm - offset_mm_) / (kMmPerM * scale_);
}

void Workspace::set_clutch(bool pressed, const DeviceSample& sample) noexcept {
    if (pressed && !clutched_)
        held_ = tool(sample);
    const bool released = clutched_ && !pressed;
    clutched_ = pressed;
    if (released)
        anchor(held_, sample);
}

void Workspace::set_scale(double scale, const DeviceSample& sample) noexcept {
    const ToolPose before = tool(sample);
    scale_ = scale;
    anchor(before, sample);
}

void Workspace::anchor(const ToolPose& tool, const DeviceSample& sample) noexcept {
    offset_mm_ = tool.position_mm - rotation_ * (kMmPerM * scale_ * sample.position_m);
    tool_turn_ = glm::conjugate(rotation_ * sample.rotation) * tool.rotation;
}

} // namespace palpate::haptics
