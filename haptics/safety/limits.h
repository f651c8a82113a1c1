#pragma once

#include <cstdint>

namespace palpate::haptics {

// The numbers of the safety chain; SI. These are the defaults for a person with a desktop device.
struct SafetyLimits {
    // 1 Input: samples beyond these limits are rejected.
    double outside_m = 0.020;      // beyond the device's workspace, on each axis
    double most_speed_m_per_s = 3; // as reported, and of the way since the last good sample
    // How long the last good sample stands in for bad ones. A sample may be older than that by a
    // period of the device, and a device may leave forces aside for as long.
    int64_t hold_ns = 5'000'000;
    double speed_s = 0.005; // time constant of the speed that is measured from samples' ways

    // 2 Enable: soft start.
    double start_force_n = 0.2;          // the rendered force must be below it ...
    uint32_t start_ticks = 4;            // ... for so many ticks before any force goes out
    double ramp_s = 2.0;                 // from none to all of it
    double ramp_damping_n_s_per_m = 3.0; // comes within the ramp's first tenth; fades with it
    bool needs_dead_man = false;         // a button that must stay pressed
    uint32_t dead_man_button = 0;

    // 4 Passivity.
    double passivity_damping_n_s_per_m = 20.0; // at most; the device's own limit counts too
    double passivity_leak_s = 0.5;             // time constant in which banked energy is lost
    double passivity_slew_n_per_s = 20.0;      // of what a spring's damping does not cover

    // Shaking: reversals of a motion faster than this (tremor of 0.1 mm at 12 Hz is slower), with
    // more than this force between them. A hand makes at most shake_turns_per_s of them by will (8
    // Hz); so many beyond that are a limit cycle.
    double shake_speed_m_per_s = 0.02;
    double shake_force_n = 0.5;
    double shake_turns_per_s = 16.0;
    // Three go by until swings are damped (self_driven.h); what still goes on is no blow's ringing.
    double shake_turns = 4.0;
    // A swing counts with so much of the speed of the one before it in its direction: what keeps
    // less dies away by itself. A relaxed hand (1.9 N s/m, 0.23 kg) on 1000 N/m keeps 0.67.
    double shake_kept = 0.75;
    double shake_few_turns = 1.5; // enough where the forces seem to drive it (self_driven.h)

    // 5 Magnitude.
    double most_force_n = 6.0;
    double most_torque_nm = 0.2;
    double device_share = 0.8; // of what the device can give

    // 6 Slew and impulse.
    double rise_n_per_s = 2000.0;
    double fall_n_per_s = 5000.0;
    double lever_m = 0.02; // torque: the same over this lever, 40 and 100 N m/s
    double impulse_s =
        0.1; // the integral of |F| over so long stays below the magnitude limit times it

    // 7 Heat of the motors, as the square of force through one time constant.
    double continuous_share = 0.6; // of the magnitude limit, that may last for ever
    double heat_s = 10.0;

    // 8 Velocity.
    double trip_speed_m_per_s = 0.8; // with more than ...
    double trip_force_share = 0.5;   // ... of the magnitude limit
    double trip_ramp_s = 0.020;      // down to nothing

    // 9 Lateness of ticks.
    int64_t late_ns = 3'000'000;      // force ramps down
    int64_t too_late_ns = 10'000'000; // none, and a soft start

    // 10 History before a fault.
    double history_s = 1.0;
};

} // namespace palpate::haptics
