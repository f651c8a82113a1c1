#pragma once

#include <span>
#include <string>
#include <vector>

#include "haptics/safety/passivity.h"
#include "haptics/safety/self_driven.h"
#include "haptics/safety/stages.h"

namespace palpate::haptics {

// Reasons why force was removed or made less. Bits; the first eight are latched until arm().
enum Fault : uint32_t {
    kFaultInput = 1u << 0,     // implausible samples, for longer than the hold time
    kFaultGone = 1u << 1,      // the device does not answer any more
    kFaultNotFinite = 1u << 2, // the rendered force is not finite
    kFaultVelocity = 1u << 3,  // fast under much force
    kFaultShaking = 1u << 4,   // a limit cycle: stiffer than the device is stable
    kFaultHeld = 1u << 8,      // this tick goes on with the last good sample
    kFaultLate = 1u << 9,      // this tick came late: force fades
    kFaultTooLate = 1u << 10,  // so late that force starts anew
    kFaultSoftened = 1u << 11, // the coupling is softer than asked, as the device allows
    kFaultDamped = 1u << 12,   // the handle swings, and that is damped (self_driven.h)
    kFaultLatched = 0xFF,
};
std::string fault_text(uint32_t faults); // "input, velocity"; "none"

// The limits applied to a device.
double most_force_n(const SafetyLimits& limits, const DeviceCapabilities& device) noexcept;
// The stiffest coupling, as the hand feels it, that the device holds: its maker's limit, and what
// the damping of the passivity controller keeps stable at this rate and behind the device's delay,
// b / (T / 2 + delay) (Colgate & Schenkel 1997; with delay: Gil, Sanchez, Hulin, Preusche &
// Hirzinger 2009).
double most_stiffness_n_per_m(const SafetyLimits& limits, const DeviceCapabilities& device,
                              double rate_hz) noexcept;
Passivity::Settings passivity_settings(const SafetyLimits& limits,
                                       const DeviceCapabilities& device) noexcept;

// One tick of the last second, to explain a fault.
struct SafetyRecord {
    int64_t now_ns = 0;
    DeviceStatus status = DeviceStatus::ok;
    DeviceSample sample; // as it came
    Wrench wanted, sent;
    uint32_t faults = 0;
    double share = 0.0; // of soft start
};

// Ten stages between the rendered force and the hand, in this order:
//
//   begin(): 9 lateness, 1 input; returns the sample to use
//   finish(): 3 not finite, 2 soft start, 4 passivity and shaking, 5 magnitude, 6 impulse and slew,
//             7 heat, 8 velocity, 10 latch and history
//   written(): 10 a device that does not take what is sent
//
// For any input the output is finite, at most 0.8 of the device's limit, and 0 from the tick of a
// latched fault (after a velocity trip: 20 ms later) until arm(). No stage can be switched off. The
// output is a function of the arguments, time included. Nothing allocates after construction. This
// is software for research and visualisation, no medical device.
class SafetyChain {
 public:
    SafetyChain(const SafetyLimits& limits, const DeviceCapabilities& device,
                double rate_hz = 1000.0);

    // Clears latched faults and begins a soft start. Call it when a person has confirmed.
    void arm() noexcept;
    void disarm() noexcept { start_.disarm(); }
    // A watchdog has taken force away since the last tick (write_gate.h): the next one is too late.
    void halted() noexcept { halted_ = true; }

    // The sample to use. `due_ns` is when the tick should have come; it is late, too, where the
    // tick before began more than a period ago. usable false: there is none; the tick renders
    // nothing.
    struct Begun {
        bool usable = false;
        bool fresh = false; // it is not a held one
        DeviceSample sample;
    };
    Begun begin(int64_t now_ns, int64_t due_ns, DeviceStatus status,
                const DeviceSample& sample) noexcept;

    // The wrench to send, in the device's axes. stiffness_n_per_m is that of the coupling as the
    // hand feels it; 0 where there is none.
    Wrench finish(const Wrench& wanted, double stiffness_n_per_m) noexcept;

    // Takes the device's answer to the wrench of this tick. A device that is gone, or that has left
    // forces aside for limits.hold_ns, has a fault: nobody knows what it renders.
    void written(DeviceStatus status) noexcept;
    // In this tick the coupling was made softer (most_stiffness_n_per_m()).
    void softened() noexcept { faults_ |= kFaultSoftened; }

    uint32_t faults() const noexcept { return faults_; }
    bool latched() const noexcept { return (faults_ & kFaultLatched) != 0; }
    SoftStart::Mode mode() const noexcept { return start_.mode(); }
    double share() const noexcept { return now_.share; }
    double heat() const noexcept { return heat_.level(); }
    const Passivity& passivity() const noexcept { return passivity_; }
    const SelfDriven& self_driven() const noexcept { return self_driven_; }
    double most_force_n() const noexcept { return most_n_; }
    // Damping that soft start and passivity added in the last tick, before the force limits; N.
    double damping_n() const noexcept { return damping_n_; }

    // The last second, oldest first; the last entry is the tick of the fault where one is latched,
    // because from then on nothing is written. Not from the servo thread: it allocates.
    std::vector<SafetyRecord> history() const;

 private:
    void latch(uint32_t fault) noexcept;

    SafetyLimits limits_;
    DeviceCapabilities device_;
    double most_n_, most_nm_;

    InputCheck input_;
    SoftStart start_;
    Passivity passivity_;
    Shaking shaking_;
    SelfDriven self_driven_;
    ImpulseLimit impulse_;
    Heat heat_;
    uint32_t faults_ = 0;
    double fade_ = 1.0;      // of a late tick, and of samples that do not come
    int64_t silence_ns_ = 0; // of a device that sets the pace: the next sample was due so long ago
    double damping_n_ = 0.0, settling_ = 0.0;
    bool ready_ = false, usable_ = false, is_fresh_ = false;
    double dt_s_;
    int64_t period_ns_;
    int64_t last_ns_ = 0, taken_ns_ = 0; // the last tick; the last one whose wrench was taken
    bool has_last_ = false, halted_ = false;
    DeviceSample used_;
    Wrench sent_;

    SafetyRecord now_;
    bool closed_ = false; // the fault's tick has been written
    std::vector<SafetyRecord> history_;
    size_t written_ = 0;
};

} // namespace palpate::haptics
