#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string_view>

#include "haptics/core/device.h"
#include "haptics/core/workspace.h"
#include "haptics/device/hand_path.h"
#include "haptics/device/hand_source.h"
#include "haptics/device/velocity.h"

namespace palpate::haptics {

// Mechanics of a device beside its capabilities, at the handle, the same on each
// axis.
struct DevicePlant {
    double mass_kg = 0.2;
    double damping_n_s_per_m = 0.5;
    double coulomb_n = 0.0;      // dry friction; what the handle resists before it moves
    double encoder_step_m = 0.0; // 0: exact
    static constexpr uint32_t kMostDelayTicks = 2;
    uint32_t delay_ticks = 0; // writes between a force and the moment it acts
};

struct DevicePreset { // a simulated device by name
    const char* name;
    DeviceCapabilities capabilities;
    DevicePlant plant;
};

// Devices like those people have: falcon, touch, omega, and ideal (no friction, no steps, no
// limits). Plausible parameters, not facts about any product: limits and steps are those published
// by makers and drivers, masses and frictions are estimates.
std::span<const DevicePreset> device_presets();
const DevicePreset* find_device_preset(std::string_view name);

// The hand that holds the device: its mass moves with the handle, and a spring and a damper pull it
// to its intended position. grip scales all three: 0 is no hand, 1 a relaxed hand, 3 a firm one.
// (Kuchenbecker, Park & Niemeyer, Characterizing the human wrist, 2003, find such orders.)
struct HandModel {
    double mass_kg = 0.1;
    double damping_n_s_per_m = 3.0;
    double stiffness_n_per_m = 300.0;
    double grip = 1.0;
};

// A device with a hand on it, as a differential equation
//
//     (m + m_h) x'' = f - b x' - f_c x'/|x'| + k_h (x_i - x) + b_h (x_i' - x')
//
// solved every 20 us with the force held between writes, as motors do. Dry friction and damping are
// taken at the end of each step (implicitly), so that what sticks stays. The box of the workspace
// is a hard stop. Everything is a function of the times and wrenches given: no clock, no chance.
class SimulatedDevice final : public HapticDevice {
 public:
    static constexpr int64_t kStep_ns = 20'000;
    static constexpr int64_t kNever_ns = std::numeric_limits<int64_t>::max();

    // The hand follows `path`, which is in world millimetres, through `workspace` as it is now: at
    // the start it rests at the path's first pose. Time 0 of the path is start_ns.
    SimulatedDevice(const DevicePreset& preset, const HandModel& hand, const HandPath& path,
                    const Workspace& workspace, int64_t start_ns = 0);
    // The hand follows `source`, whose time begins at start_ns; at the start it rests there.
    SimulatedDevice(const DevicePreset& preset, const HandModel& hand,
                    std::shared_ptr<HandSource> source, int64_t start_ns = 0);

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    // The encoders find their zero at once where the device needs homing.
    Result<void> home() override;
    // The handle is in the middle of the workspace: its place now reads as 0.
    Result<void> calibrate() override;
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override;
    // Acts from now_ns on, wherever the equation has got to.
    void halt(int64_t now_ns) noexcept override {
        halted_ns_.store(now_ns, std::memory_order_release);
    }

    // The true state, at the time of the last read or write.
    glm::dvec3 true_position_m() const noexcept { return position_m_; }
    glm::dvec3 true_velocity_m_per_s() const noexcept { return velocity_m_per_s_; }
    glm::dvec3 acting_force_n() const noexcept { return acting_.force_n; }
    // The work of the motors on handle and hand since the start: the sum of force times way, which
    // for held forces is exact. Above 0: the loop added energy.
    double motor_work_j() const noexcept { return motor_work_j_; }

 private:
    void advance(int64_t to_ns) noexcept;
    void step(double time_s) noexcept;

    DeviceCapabilities capabilities_;
    DevicePlant plant_;
    HandModel hand_; // scaled by grip
    std::shared_ptr<HandSource> source_;
    bool is_homed_;
    glm::dvec3 zero_m_{0.0}; // reading of the encoders in the middle

    int64_t start_ns_, time_ns_;
    glm::dvec3 position_m_{0.0}, velocity_m_per_s_{0.0};
    std::array<Wrench, DevicePlant::kMostDelayTicks + 1> commanded_{}; // newest first
    Wrench acting_;
    std::atomic<int64_t> halted_ns_{kNever_ns};
    double motor_work_j_ = 0.0;
    VelocityEstimator estimator_;
    int64_t sampled_ns_;
};

} // namespace palpate::haptics
