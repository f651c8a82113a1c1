#include "haptics/device/simulated.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate::haptics {

namespace {

constexpr double kNsPerS = 1e9;

bool finite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Scaled down to `most` where it is longer; 0 where it is not finite.
glm::dvec3 limited(glm::dvec3 v, double most) {
    if (!finite(v))
        return glm::dvec3(0.0);
    const double length = glm::length(v);
    return length > most ? v * (most / length) : v;
}

} // namespace

SimulatedDevice::SimulatedDevice(const DevicePreset& preset, const HandModel& hand,
                                 const HandPath& path, const Workspace& workspace, int64_t start_ns)
    : capabilities_(preset.capabilities),
      plant_(preset.plant),
      hand_(hand),
      path_(path),
      device_from_world_(glm::conjugate(workspace.rotation())),
      is_homed_(!preset.capabilities.needs_homing),
      start_ns_(start_ns),
      time_ns_(start_ns),
      estimator_(preset.plant.encoder_step_m),
      sampled_ns_(start_ns) {
    PALPATE_ASSERT(plant_.mass_kg > 0.0);
    PALPATE_ASSERT_CMP(plant_.delay_ticks, <, commanded_.size());
    hand_.mass_kg *= hand.grip;
    hand_.damping_n_s_per_m *= hand.grip;
    hand_.stiffness_n_per_m *= hand.grip;
    intents_.reserve(path.poses().size());
    for (const HandPose& pose : path.poses())
        intents_.push_back({pose.time_s, workspace.device_position_m(pose.tool.position_mm)});
    position_m_ = intents_.front().position_m;
}

Result<void> SimulatedDevice::home() {
    if (!capabilities_.needs_homing)
        return HapticDevice::home();
    is_homed_ = true;
    return {};
}

Result<void> SimulatedDevice::calibrate() {
    zero_m_ = position_m_;
    estimator_.reset();
    return {};
}

void SimulatedDevice::step(double time_s) noexcept {
    while (intent_ + 1 < intents_.size() && intents_[intent_ + 1].time_s <= time_s)
        ++intent_;
    const Intent& from = intents_[intent_];
    glm::dvec3 meant_m = from.position_m, meant_m_per_s(0.0);
    if (time_s >= from.time_s && intent_ + 1 < intents_.size()) {
        const Intent& to = intents_[intent_ + 1];
        meant_m_per_s = (to.position_m - from.position_m) / (to.time_s - from.time_s);
        meant_m += (time_s - from.time_s) * meant_m_per_s;
    }

    constexpr double kDt = static_cast<double>(kStep_ns) / kNsPerS;
    const double impulse = kDt / (plant_.mass_kg + hand_.mass_kg); // velocity per newton
    const double slowing = 1.0 + impulse * (plant_.damping_n_s_per_m + hand_.damping_n_s_per_m);
    const glm::dvec3 driven_n = acting_.force_n +
                                hand_.stiffness_n_per_m * (meant_m - position_m_) +
                                hand_.damping_n_s_per_m * meant_m_per_s;
    glm::dvec3 velocity = (velocity_m_per_s_ + impulse * driven_n) / slowing;
    const double speed = glm::length(velocity);
    const double rubbed = impulse * plant_.coulomb_n / slowing;
    velocity = speed > rubbed ? velocity * (1.0 - rubbed / speed) : glm::dvec3(0.0);

    glm::dvec3 position = position_m_ + kDt * velocity;
    for (int axis = 0; axis < 3; ++axis) {
        const double stop = capabilities_.workspace_m[axis];
        if (std::abs(position[axis]) > stop) {
            position[axis] = std::copysign(stop, position[axis]);
            velocity[axis] = (position[axis] - position_m_[axis]) / kDt;
            if (std::abs(position_m_[axis]) >= stop)
                velocity[axis] = 0.0;
        }
    }
    motor_work_j_ += glm::dot(acting_.force_n, position - position_m_);
    position_m_ = position;
    velocity_m_per_s_ = velocity;
}

void SimulatedDevice::advance(int64_t to_ns) noexcept {
    for (; time_ns_ + kStep_ns <= to_ns; time_ns_ += kStep_ns) {
        if (time_ns_ >= halted_ns_.load(std::memory_order_acquire)) {
            commanded_ = {};
            acting_ = {};
        }
        step(static_cast<double>(time_ns_ - start_ns_) / kNsPerS);
    }
}

DeviceStatus SimulatedDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    advance(now_ns);
    sample.time_ns = now_ns;
    if (!is_homed_)
        return DeviceStatus::not_homed;
    glm::dvec3 seen_m = position_m_ - zero_m_;
    if (plant_.encoder_step_m > 0.0)
        seen_m = glm::floor(seen_m / plant_.encoder_step_m + 0.5) * plant_.encoder_step_m;
    sample.position_m = seen_m;
    if (now_ns > sampled_ns_ || now_ns == start_ns_) {
        // The first sample has none before it, so its step is never divided by.
        const double dt_s =
            static_cast<double>(std::max<int64_t>(now_ns - sampled_ns_, 1)) / kNsPerS;
        sample.velocity_m_per_s = estimator_.add(seen_m, dt_s);
        sampled_ns_ = now_ns;
    }
    const HandPose meant = path_.at(static_cast<double>(now_ns - start_ns_) / kNsPerS);
    sample.rotation = capabilities_.senses_rotation ? device_from_world_ * meant.tool.rotation
                                                    : glm::dquat(1.0, 0.0, 0.0, 0.0);
    sample.buttons = meant.buttons;
    return DeviceStatus::ok;
}

DeviceStatus SimulatedDevice::write(int64_t now_ns, const Wrench& wrench) noexcept {
    advance(now_ns);
    if (halted_ns_.exchange(kNever_ns, std::memory_order_acq_rel) != kNever_ns)
        commanded_ = {}; // what was on its way is lost
    commanded_[2] = commanded_[1];
    commanded_[1] = commanded_[0];
    commanded_[0] = {limited(wrench.force_n, capabilities_.max_force_n),
                     limited(wrench.torque_nm, capabilities_.max_torque_nm)};
    acting_ = commanded_[plant_.delay_ticks];
    return DeviceStatus::ok;
}

} // namespace palpate::haptics
