#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::haptics {

// Passivity observer and controller, in the time domain, for a device that is pushed by held
// forces.
//
// The observer tracks the energy that the loop generates: the work W of the sent forces, which for
// held forces is exactly f . dx a tick, plus the energy V of the virtual spring. W + V above 0: the
// simulation added energy. The controller dissipates it with the damping that would consume it
// within a tick, alpha = E / (T v^2), at most the device's stable damping. A sampled spring makes k
// v^2 T^2 / 2 a tick, so that alpha comes out as k T / 2: the bound of Colgate & Schenkel (1997).
// Damping up to three times that, as a spring needs behind a tick of delay, changes within 8 ticks.
// Larger damping, as where a tool moves between hollows, changes with slew_n_per_s, so that it is
// no impact itself. Where it would push, at a reversal, it is released at once; force that does not
// oppose the motion fades within some 10 ms.
//
// Behind a cable a sample is old and a force acts later: together by delay_s, what a device states
// as its delay. The force over the way between two samples is then the one that was sent delay_s
// before; where delay_s is no whole tick, the mean of the two that shared that time. W is again
// exact for held forces and even motion within a tick. A spring whose force comes late by D makes
// k v^2 T D a tick more, and what the controller sends acts late, too: damping that is on its way
// counts as done at the speed of now, so that the same energy is not dissipated twice.
//
// Dissipated energy (below 0) is forgotten with the time constant leak_s, so that long motion in
// viscous material does not hide energy generated later. Sources: B. Hannaford, J.-H. Ryu,
// Time-domain passivity control of haptic interfaces, IEEE Trans. Robotics and Automation 18(1),
// 2002; the stored energy as in J.-H. Ryu et al., 2004.
class Passivity {
 public:
    struct Settings {
        double most_damping_n_s_per_m = 20.0;
        double leak_s = 0.5;
        double slew_n_per_s = 20.0;
        // Lost is what the controller cannot get back soon: E is kept at or below it.
        double most_j = 0.05;
        // From the moment a sample was taken until the force of the tick that reads it acts, beyond
        // that tick; >= 0. A longer delay than kMostDelay_s counts as that.
        double delay_s = 0.0;
    };
    static constexpr double kMostDelay_s = 0.040;
    explicit Passivity(const Settings& settings) : settings_(settings) {
        settings_.delay_s = std::min(settings_.delay_s, kMostDelay_s);
    }

    void reset() noexcept;

    // The virtual spring: its energy now, and its stiffness to the hand.
    struct Spring {
        double stored_j = 0.0, stiffness_n_per_m = 0.0;
    };
    // The force to send in place of `force_n`. `position_m` is where the sample says that the
    // device is; is_fresh false: a sample that stands in for one that did not come, and nothing is
    // observed until the next. dt_s > 0 since the last call, all finite.
    //
    // Damping acts on the velocity that the device's driver estimates, not on the way of one tick:
    // one encoder step of 50 um in a tick would read as 50 mm/s, and cause an impact.
    glm::dvec3 limit(glm::dvec3 position_m, glm::dvec3 velocity_m_per_s, glm::dvec3 force_n,
                     Spring spring, double dt_s, bool is_fresh = true) noexcept;
    // The force sent after the later stages; work is counted with it.
    void sent(glm::dvec3 force_n) noexcept { sent_[next_].force_n = force_n; }

    double made_j() const noexcept { return made_j_; }   // E, see above
    double work_j() const noexcept { return work_j_; }   // W since the reset, without leak
    double damping() const noexcept { return damping_; } // of the last tick, N s/m

 private:
    // Forces are remembered for so many ticks: kMostDelay_s at 10 kHz, and a fifth more.
    static constexpr uint32_t kMostSent = 480;
    Settings settings_;
    struct Sent {
        glm::dvec3 force_n{0.0};
        double damping_n_s_per_m = 0.0; // within it
        double dt_s = 0.0;              // that it was held for
    };
    // Means of what was sent from to_s to from_s before now.
    struct Held {
        glm::dvec3 force_n{0.0};
        double damping_n_s_per_m = 0.0;
    };
    Held mean(double from_s, double to_s) const noexcept;
    void observe(glm::dvec3 position_m, double stored_j) noexcept;

    bool has_last_ = false;
    glm::dvec3 last_m_{0.0};
    double unseen_s_ = 0.0;              // since the last fresh sample
    std::array<Sent, kMostSent> sent_{}; // a ring; next_: the newest
    uint32_t next_ = 0, count_ = 1;      // count_: of entries since the reset
    double last_stored_j_ = 0.0;
    double made_j_ = 0.0, work_j_ = 0.0, damping_ = 0.0;
    double steady_ = 0.0; // N s/m
    glm::dvec3 slow_n_{0.0};
};

// The energy of a spring of stiffness k whose force is cut off at most_n, where it would be
// `force_n` without the cut: f^2 / 2k, and beyond the cut a constant force times the way. k > 0.
double stored_energy_j(double force_n, double stiffness_n_per_m, double most_n) noexcept;

} // namespace palpate::haptics
