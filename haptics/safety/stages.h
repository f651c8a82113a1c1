#pragma once

#include <array>
#include <cstdint>

#include "haptics/core/device.h"
#include "haptics/safety/limits.h"

// The stages of the safety chain with state. Each is a plain state and a function, tested alone.
// chain.h puts them in order.
namespace palpate::haptics {

// 1 Accepts a sample that is new, finite, within reach and not faster than a hand; otherwise the
// last good sample is used for a while. For samples that a device which sets the pace leaves out it
// stands in for limits.too_late_ns, and then nothing is known until the next one.
class InputCheck {
 public:
    enum class Verdict : uint8_t {
        good,
        held,   // a bad sample; the last good one is used
        lost,   // bad for too long, or the device is gone
        absent, // nothing has been good yet, or the device is not homed
    };
    // `sample` becomes the one to use. limits and device stay the same from call to call.
    Verdict check(const SafetyLimits& limits, const DeviceCapabilities& device, int64_t now_ns,
                  DeviceStatus status, DeviceSample& sample) noexcept;
    void reset() noexcept { *this = {}; }
    // By the ways between good samples, whatever the driver says; first order, limits.speed_s.
    glm::dvec3 velocity_m_per_s() const noexcept { return velocity_m_per_s_; }
    // Since the next sample after the last good one was due; 0 where there is none.
    int64_t silence_ns(const DeviceCapabilities& device, int64_t now_ns) const noexcept;

 private:
    Verdict hold(int64_t now_ns, DeviceSample& sample) const noexcept;

    bool has_good_ = false;
    DeviceSample good_;
    glm::dvec3 velocity_m_per_s_{0.0};
};

// 2 No force is sent until a person armed it, the device is ready and the rendered force is near 0
// for some ticks; then force fades in.
class SoftStart {
 public:
    enum class Mode : uint8_t { disarmed, waiting, ramping, running };
    void arm() noexcept { mode_ = mode_ == Mode::disarmed ? Mode::waiting : mode_; }
    void disarm() noexcept { mode_ = Mode::disarmed; }
    void again() noexcept; // from the wait, where it was beyond it

    // The share of force to send: 0 .. 1. `ready`: the device answers and the dead man's button is
    // pressed; losing it fades force out within limits.trip_ramp_s and starts again.
    double share(const SafetyLimits& limits, bool ready, double rendered_n, double dt_s) noexcept;
    Mode mode() const noexcept { return mode_; }

 private:
    Mode mode_ = Mode::disarmed;
    uint32_t quiet_ticks_ = 0;
    double share_ = 0.0;
};

// 4 Recognises the limit cycle of a coupling that is too stiff for its device or its delay: a
// motion under force that reverses more often than a hand can. A swing that has lost much of the
// speed of the one before it in the same direction is the ringing of a blow that dies away, as
// where a hand taps, and does not count.
class Shaking {
 public:
    bool shakes(const SafetyLimits& limits, glm::dvec3 velocity_m_per_s, glm::dvec3 sent_n,
                double dt_s) noexcept;
    void reset() noexcept { *this = {}; }
    double turns() const noexcept { return turns_; } // beyond a hand's

 private:
    glm::dvec3 swing_m_per_s_{0.0};          // the fastest since the last reversal
    std::array<double, 2> before_m_per_s_{}; // of the last two swings, the newest first
    double force_n_ = 0.0, turns_ = 0.0; // the largest force since then; reversals beyond a hand's
};

// 5 Direction-preserving limit; also of vectors that are not finite: 0.
glm::dvec3 limit_magnitude(glm::dvec3 vector, double most) noexcept;

// 6 The integral of |F| over the last impulse_s, kept below most_n * impulse_s: from 80 % of that
// on, force is scaled down evenly. What is about to leave that time is known to half a bin, a
// hundredth of it.
class ImpulseLimit {
 public:
    glm::dvec3 limit(glm::dvec3 force_n, double most_n, double window_s, double dt_s) noexcept;
    void sent(glm::dvec3 force_n, double dt_s) noexcept;
    void reset() noexcept { *this = {}; }

 private:
    static constexpr uint32_t kBins = 50;
    // N s, each of a fiftieth of the window; of the oldest one the part counts that is still in it,
    // so that what is sent at a steady force does not waver as bins end.
    std::array<double, kBins + 1> bins_{};
    uint32_t bin_ = 0;
    double in_bin_s_ = 0.0, bin_s_ = 0.0;
};

// 6 How far force, or torque, may change in a tick, as a vector, straight towards `wanted`: where
// that is no smaller, by `rise` a second. Else the part that is let go, towards nothing and no
// farther, takes its time at `fall` a second, and what is new beside it, a turn, at `rise`; both
// must fit into the tick together.
glm::dvec3 limit_slew(double rise, double fall, glm::dvec3 before, glm::dvec3 wanted,
                      double dt_s) noexcept;

// 7 Estimates the motors' heat; 1 is what continuous_share of the limit reaches in the end.
class Heat {
 public:
    // The most that may be sent now: most_n when cool, down to the continuous force from 1.2 on.
    double most(const SafetyLimits& limits, double most_n) const noexcept;
    void sent(const SafetyLimits& limits, double force_n, double most_n, double dt_s) noexcept;
    double level() const noexcept { return level_; }
    bool warns() const noexcept { return level_ > 0.8; }

 private:
    double level_ = 0.0;
};

} // namespace palpate::haptics
