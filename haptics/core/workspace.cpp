#include "haptics/core/workspace.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate::haptics {

namespace {

constexpr double kMmPerM = 1000.0;

bool is_sane(const WorkspaceSettings& s) {
    return s.scale > 0.0 && std::isfinite(s.scale) &&
           std::abs(glm::dot(s.rotation, s.rotation) - 1.0) < 1e-6;
}

} // namespace

glm::dquat aligned_with_view(glm::dvec3 right, glm::dvec3 up) noexcept {
    return glm::normalize(glm::quat_cast(glm::dmat3(right, up, glm::cross(right, up))));
}

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

void Workspace::move(double scale, glm::dquat rotation, const DeviceSample& sample) noexcept {
    const ToolPose before = tool(sample);
    scale_ = scale;
    rotation_ = rotation;
    if (!clutched_) // else it is anchored where the clutch is released
        anchor(before, sample);
}

void Workspace::follow(const WorkspaceSettings& wanted, const DeviceSample& sample,
                       double dt_s) noexcept {
    set_clutch(wanted.clutched, sample);
    force_share_ = std::clamp(
        clutched_ ? force_share_ - dt_s / kClutchOut_s : force_share_ + dt_s / kClutchIn_s, 0.0,
        1.0);
    if ((wanted.scale == scale_ && wanted.rotation == rotation_) || !is_sane(wanted))
        return;
    const double most = kScaleRate_per_s * dt_s;
    const double scale =
        std::clamp(wanted.scale, scale_ * (1.0 - std::min(most, 0.5)), scale_ * (1.0 + most));
    // The shorter way; the dot of two rotations is the cosine of half the angle between them.
    const double dot = glm::dot(rotation_, wanted.rotation);
    const double angle = 2.0 * std::acos(std::min(1.0, std::abs(dot)));
    const double turn = kTurnRate_rad_per_s * dt_s;
    const glm::dquat rotation =
        angle <= turn ? wanted.rotation
                      : glm::normalize(glm::slerp(rotation_, wanted.rotation, turn / angle));
    move(scale, rotation, sample);
}

void Workspace::anchor(const ToolPose& tool, const DeviceSample& sample) noexcept {
    offset_mm_ = tool.position_mm - rotation_ * (kMmPerM * scale_ * sample.position_m);
    tool_turn_ = glm::conjugate(rotation_ * sample.rotation) * tool.rotation;
}

} // namespace palpate::haptics
