#pragma once

#include <algorithm>
#include <glm/glm.hpp>

namespace palpate::haptics {

// How much of the way along a surface that planes of one place say is worth going there: all of it
// on a plane, R / (R + d) of it in a hollow of radius R which the hand is pushed d into. Where that
// is below a half, going all the way overshoots farther each time.
//
// The secant step of Barzilai & Borwein (1988), as a regression over the last steps in which long
// ones count most; what was learnt in ticks before counts, too, for a surface bends much alike
// where a tool slides. 0.1 to 1: on what bulges, steps are as long as planes say.
class SlideGain {
 public:
    double value() const { return went_ < changed_ ? std::max(kLeast, went_ / changed_) : 1.0; }
    // From a step along the surface and what was still to go there before and after it.
    void learn(glm::dvec3 step_mm, glm::dvec3 before_mm, glm::dvec3 after_mm) {
        if (glm::length(step_mm) < kTelling_mm)
            return;
        went_ = kKept * went_ + glm::dot(step_mm, step_mm);
        changed_ = kKept * changed_ + glm::dot(step_mm, before_mm - after_mm);
    }
    // After a step that nothing can be learnt from: some of the way back to 1.
    void doubt() {
        if (went_ < changed_)
            changed_ += 0.1 * (went_ - changed_);
    }

 private:
    static constexpr double kKept = 0.95, kLeast = 0.1, kTelling_mm = 2e-4;
    double went_ = 0.0, changed_ = 0.0; // mm^2
};

} // namespace palpate::haptics
