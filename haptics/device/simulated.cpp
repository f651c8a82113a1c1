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

// A path through a workspace.
class PathSource final : public HandSource {
 public:
    PathSource(const HandPath& path, const Workspace& workspace)
        : path_(path), device_from_world_(glm::conjugate(workspace.rotation())) {
        intents_.reserve(path.poses().size());
        for (const HandPose& pose : path.poses())
            intents_.push_back({pose.time_s, workspace.device_position_m(pose.tool.position_mm)});
    }

    Meant meant(double time_s) noexcept override {
        while (intent_ + 1 < intents_.size() && intents_[intent_ + 1].time_s <= time_s)
            ++intent_;
        const Intent& from = intents_[intent_];
        Meant meant{from.position_m};
        if (time_s >= from.time_s && intent_ + 1 < intents_.size()) {
            const Intent& to = intents_[intent_ + 1];
            meant.velocity_m_per_s = (to.position_m - from.position_m) / (to.time_s - from.time_s);
            meant.position_m += (time_s - from.time_s) * meant.velocity_m_per_s;
        }
        return meant;
    }
    Held held(double time_s) noexcept override {
        const HandPose pose = path_.at(time_s);
        return {device_from_world_ * pose.tool.rotation, pose.buttons};
    }

 private:
    struct Intent {
        double time_s;
        glm::dvec3 position_m;
    };
    HandPath path_;
    glm::dquat device_from_world_;
    std::vector<Intent> intents_; // the path's poses in the device's space
    size_t intent_ = 0;           // the last at or before now
};

} // namespace

SimulatedDevice::SimulatedDevice(const DevicePreset& preset, const HandModel& hand,
                                 const HandPath& path, const Workspace& workspace, int64_t start_ns)
    : SimulatedDevice(preset, hand, std::make_shared<PathSource>(path, workspace), start_ns) {
    // Before its first pose the path rests there.
    position_m_ = workspace.device_position_m(path.poses().front().tool.position_mm);
}

SimulatedDevice::SimulatedDevice(const DevicePreset& preset, const HandModel& hand,
                                 std::shared_ptr<HandSource> source, int64_t start_ns)
    : capabilities_(preset.capabilities),
      plant_(preset.plant),
      hand_(hand),
      source_(std::move(source)),
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
    position_m_ = source_->meant(0.0).position_m;
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
    const HandSource::Meant meant = source_->meant(time_s);
    constexpr double kDt = static_cast<double>(kStep_ns) / kNsPerS;
    const double impulse = kDt / (plant_.mass_kg + hand_.mass_kg); // velocity per newton
    const double slowing = 1.0 + impulse * (plant_.damping_n_s_per_m + hand_.damping_n_s_per_m);
    const glm::dvec3 driven_n = acting_.force_n +
                                hand_.stiffness_n_per_m * (meant.position_m - position_m_) +
                                hand_.damping_n_s_per_m * meant.velocity_m_per_s;
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
    const HandSource::Held held = source_->held(static_cast<double>(now_ns - start_ns_) / kNsPerS);
    sample.rotation =
        capabilities_.senses_rotation ? held.rotation : glm::dquat(1.0, 0.0, 0.0, 0.0);
    sample.buttons = held.buttons;
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
