#pragma once

#include <glm/glm.hpp>

#include "haptics/field/algorithm.h"

// Effects added to a proxy's spring, the same for every repaired algorithm.
namespace palpate::haptics {

// Moves `current` towards `target` by at most 5 % of the larger a millisecond.
double slewed(double current, double target, double dt_s);

// White noise through a second-order high-pass at 20 Hz and low-pass at 400 Hz (Butterworth, made
// discrete by the bilinear transform): vibration that motors can follow and hands can feel. The
// amplitude is a bound: the output is clamped to +-1.
class BandNoise {
 public:
    // dt_s up to 1 ms; above, the low-pass is at 0.4 / dt.
    double next(double dt_s);

 private:
    struct Biquad {
        double b0 = 0, b1 = 0, b2 = 0, a1 = 0, a2 = 0; // coefficients
        double z1 = 0, z2 = 0;                         // state
        double step(double x) {
            const double y = b0 * x + z1;
            z1 = b1 * x - a1 * y + z2;
            z2 = b2 * x - a2 * y;
            return y;
        }
    };
    uint64_t random_ = 1;
    double dt_s_ = 0.0;
    Biquad high_, low_;
};

// A rendered position that follows another one, which may jump: see(target) on an edit keeps the
// difference and bleeds it off at a speed.
class Bleed {
 public:
    // The geometry now says `now` where a moment ago `before` was rendered; motion of the tool
    // explains `natural_mm` of the difference.
    void take_up(glm::dvec3 before_mm, glm::dvec3 now_mm, double natural_mm);
    // Shrinks by speed * dt and returns what is left to add.
    glm::dvec3 next(double speed_mm_per_s, double dt_s);
    glm::dvec3 left_mm() const { return left_mm_; }
    bool is_over() const { return left_mm_ == glm::dvec3(0.0); }
    void forget() { left_mm_ = glm::dvec3(0.0); }

 private:
    glm::dvec3 left_mm_{0.0};
};

} // namespace palpate::haptics
