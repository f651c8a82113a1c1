#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::haptics {

// Recognises a motion that the device's own forces keep up: the limit cycle of a coupling that is
// too stiff for its device or its delay. The delay may be longer than the driver states, and the
// frequency one that a hand can have, too.
//
// A hand that holds answers a force passively,
//
//     f(t - D) = m x'' + b x' + c x'/|x'| + k (x - x0),    m > 0, k >= 0,
//
// and a hand that moves by will does not: what its muscles do is no such function of its motion.
// The force is fitted by least squares for each of kLags delays D. The stated delay counts, unless
// another one leaves much less of the force unexplained: less than half at fast ticks, and less
// where slow ones leave fewer independent values (better_at()). Where the fit explains the
// force, and the force works on the motion, f(t - D) . x' > 0 in the mean over several reversals,
// the device drives the motion. A pure sine under a linear spring fits for every D: then the stated
// one counts, until a contact is lost or a limit is reached and the force is no sine any more.
//
// Force and motion are filtered alike: x'' is a second difference over some milliseconds, which is
// x'' under a triangle, and the force is taken under the same triangle. Sums are forgotten with
// kForget_s. Neither allocates nor throws. Its work is done once a millisecond at most.
class SelfDriven {
 public:
    static constexpr double kMostDelay_s = 0.020;  // that is looked for
    static constexpr double kMostStated_s = 0.040; // a longer one counts as that
    explicit SelfDriven(double stated_delay_s = 0.0) noexcept;
    void reset() noexcept { *this = SelfDriven(lags_s_[0]); }

    // A sample, and the force that was sent and held for the dt_s > 0 before it. True: the device
    // drives the motion. is_fresh false: the sample stands in for one that did not come.
    bool drives(glm::dvec3 position_m, glm::dvec3 held_n, double dt_s,
                bool is_fresh = true) noexcept;

    // Less sure, since the last point: enough for a motion that reverses more often than a hand's.
    bool seems_driven() const noexcept { return seems_driven_; }

    // The damping that ends swings which need not be driven: those of a heavy device in a light
    // hand die away slowly, and those that are driven a little look like a hand's that taps. 0
    // where the motion does not swing. It is stable behind any delay that is looked for.
    double settling_n_s_per_m() const noexcept { return settling_; }

    struct Fit {
        double delay_s = 0.0;
        double explained = 0.0;    // of the force's variance, 0 .. 1
        double power_factor = 0.0; // mean of f . x' over the root of the means of f^2 and x'^2
        double least_power_factor = 0.0;               // of delays that fit about as well
        double held_phase = 0.0;                       // of half a tick, radians
        double least_phase = 0.0;                      // and of half a step of the delays
        double work_j = 0.0;                           // of f in the time that is remembered
        double force_n = 0.0, speed_m_per_s = 0.0;     // roots of the mean squares
        double mass_kg = 0.0, stiffness_n_per_m = 0.0; // m and k
    };
    const Fit& fit() const noexcept { return fit_; } // the last one

 private:
    static constexpr uint32_t kLags = 22, kPoints = 64, kTerms = 4, kTurns = 3;
    struct Point { // a sample, and the integrals of the force up to it
        double time_s = 0.0;
        glm::dvec3 position_m{0.0}, once{0.0}, twice{0.0};
    };
    const Point& back(uint32_t points) const noexcept {
        return points_[(next_ + 2 * kPoints - 1 - points) % kPoints];
    }
    glm::dvec3 twice_at(double time_s) const noexcept;
    void rebase() noexcept;
    bool take_in(double passed_s) noexcept;
    void solve(double tick_s) noexcept;

    std::array<double, kLags> lags_s_; // the stated one, then from 0 on
    std::array<Point, kPoints> points_{};
    uint32_t next_ = 0, count_ = 0;
    Point now_;
    double clock_s_ = 0.0; // since the reset
    // Weighted sums: of 1, of terms, and of their products; and for each lag of the force.
    struct Lag {
        glm::dvec3 force{0.0};
        double square = 0.0;
        std::array<double, kTerms> products{};
    };
    double weight_ = 0.0;
    std::array<glm::dvec3, kTerms> terms_{};
    std::array<std::array<double, kTerms>, kTerms> products_{};
    std::array<Lag, kLags> of_lag_{};
    // The last reversals of a motion that is faster than a speed.
    struct Turns {
        glm::dvec3 swing_m_per_s{0.0};      // the fastest since the last reversal
        std::array<double, kTurns> times_s; // newest first
        Turns() noexcept;
        void see(glm::dvec3 velocity_m_per_s, double least_m_per_s, double clock_s) noexcept;
        bool are_often(double clock_s) const noexcept;
    };
    Turns turns_, small_turns_;
    Fit fit_;
    bool seems_driven_ = false;
    double settling_ = 0.0;
};

} // namespace palpate::haptics
