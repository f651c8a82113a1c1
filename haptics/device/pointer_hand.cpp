#include "haptics/device/pointer_hand.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

namespace {

bool is_finite(const ToolPose& tool) {
    const glm::dvec3 p = tool.position_mm;
    const double turn = glm::dot(tool.rotation, tool.rotation);
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) &&
           std::abs(turn - 1.0) < 1e-3;
}

} // namespace

PointerHand::PointerHand(const PointerTarget& first, const Workspace& workspace)
    : workspace_(workspace),
      targets_(std::make_unique<const PointerTarget>(first)),
      reader_(targets_.add_reader()),
      position_m_(workspace.device_position_m(first.tool.position_mm)),
      asked_(first.buttons),
      buttons_(first.buttons) {}

void PointerHand::point(const PointerTarget& target) {
    if (is_finite(target.tool))
        targets_.publish(std::make_unique<const PointerTarget>(target));
}

void PointerHand::take_buttons(const PointerTarget& target) noexcept {
    if ((target.buttons & ~asked_) != 0) {
        pressed_m_ = workspace_.device_position_m(target.tool.position_mm);
        arrives_ = true;
    }
    asked_ = target.buttons;
    arrives_ = arrives_ && asked_ != 0;
    if (arrives_ && glm::distance(position_m_, pressed_m_) < kThere_m)
        arrives_ = false;
    buttons_ = arrives_ ? buttons_ & asked_ : asked_;
}

// From here on.
glm::dvec3 PointerHand::way_to(const PointerTarget& target, const glm::dvec3& goal_m) noexcept {
    const glm::dvec3 to_m = goal_m - position_m_;
    const glm::dvec3 eye_m = workspace_.device_position_m(target.eye_mm) - position_m_;
    const double far_m = glm::length(eye_m);
    if (target.clear_mm <= 0.0 || buttons_ != 0 || far_m < kThere_m) {
        way_ = Way::straight;
        return to_m;
    }
    const glm::dvec3 nearer = eye_m / far_m;
    const double back_m = glm::dot(to_m, nearer);
    const double clear_m = 1e-3 * target.clear_mm / workspace_.scale();
    if (back_m > kFar_m)
        way_ = Way::back;
    if (way_ == Way::back && back_m + clear_m < kThere_m) {
        way_ = Way::aside;
        over_m_ = goal_m + clear_m * nearer;
    }
    if (way_ == Way::aside && glm::distance(over_m_, position_m_) < kThere_m)
        way_ = Way::straight;
    switch (way_) {
        case Way::back:
            return (back_m + clear_m) * nearer;
        case Way::aside:
            return over_m_ - position_m_;
        case Way::straight:
            break;
    }
    return to_m;
}

HandSource::Meant PointerHand::meant(double time_s) noexcept {
    const double dt_s = std::max(0.0, time_s - time_s_);
    time_s_ = std::max(time_s_, time_s);
    const auto target = reader_.pin();
    take_buttons(*target);
    const glm::dvec3 to_m = way_to(
        *target, arrives_ ? pressed_m_ : workspace_.device_position_m(target->tool.position_mm));
    const double way_m = glm::length(to_m);
    if (dt_s == 0.0 || way_m < 1e-12)
        return {position_m_, glm::dvec3(0.0)};
    // The exact step of the lag, so that a long time between two calls does not overshoot.
    const double gone_m = std::min(way_m * -std::expm1(-dt_s / kLag_s), kMost_m_per_s * dt_s);
    const glm::dvec3 step_m = to_m * (gone_m / way_m);
    position_m_ += step_m;
    return {position_m_, step_m / dt_s};
}

HandSource::Held PointerHand::held(double) noexcept {
    return {glm::conjugate(workspace_.rotation()) * reader_.pin()->tool.rotation, buttons_};
}

const DevicePreset& pointer_preset() {
    static const DevicePreset preset{"mouse",
                                     {.name = "a pointer with a virtual depth",
                                      .workspace_m = glm::dvec3(10.0),
                                      .max_force_n = 8.0,
                                      .max_stiffness_n_per_m = 3000.0,
                                      .max_damping_n_s_per_m = 20.0,
                                      .buttons = 2,
                                      .senses_rotation = true},
                                     {.mass_kg = 0.05, .damping_n_s_per_m = 0.0}};
    return preset;
}

HandModel pointer_hand_model() {
    constexpr double kMass_kg = 0.05, kStiffness = 400.0;
    // Critical: 2 sqrt(k m) with the handle's mass.
    return {.mass_kg = kMass_kg,
            .damping_n_s_per_m =
                2.0 * std::sqrt(kStiffness * (kMass_kg + pointer_preset().plant.mass_kg)),
            .stiffness_n_per_m = kStiffness};
}

} // namespace palpate::haptics
