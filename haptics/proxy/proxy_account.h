#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace palpate::haptics {

// The energy that a proxy's own motion added to the virtual coupling. A proxy that yields to the
// hand but for what it must not enter never lengthens the spring while the hand rests, so that all
// work of the spring is the hand's. One whose geometry errs does: it sinks in and comes out again,
// or, amid noise, is pushed from one place to the next, which makes energy from nothing for as long
// as it goes on. Here it may give back what it took, which is forgotten with a time constant of 0.1
// s, and on top of that what the spring holds over slack_mm.
//
// In squares of lengths: the spring's energy is k / 2 of that. The account is that of a passivity
// observer in the time domain (Hannaford & Ryu 2002, see passivity.h), kept for one part of the
// loop.
class ProxyAccount {
 public:
    // At the start of a tick, dt_s > 0 after the last.
    void forget(double dt_s) noexcept {
        if (given_mm2_ < 0.0)
            given_mm2_ *= std::max(0.0, 1.0 - dt_s / kKept_s);
    }
    // Allows for a constraint that itself moved by up to moved_mm against a spring of length
    // depth_mm: a tool that turned or grew. The proxy may follow it.
    void allow(double moved_mm, double depth_mm) noexcept {
        given_mm2_ -= moved_mm * (2.0 * depth_mm + moved_mm);
    }
    // How much of a step may be gone, 0 .. 1. slack_mm: by how much geometry may err. All finite.
    double share_of(glm::dvec3 from_mm, glm::dvec3 to_mm, glm::dvec3 hand_mm,
                    double slack_mm) const noexcept {
        const glm::dvec3 step = to_mm - from_mm, off = from_mm - hand_mm;
        const double length2 = glm::dot(step, step), outward = glm::dot(step, off);
        const double may_mm2 = std::max(0.0, 2.0 * slack_mm * glm::length(off) - given_mm2_);
        if (length2 + 2.0 * outward <= may_mm2)
            return 1.0;
        // Solves share^2 length2 + 2 share outward = may, in the form that loses no digits.
        const double root = std::sqrt(outward * outward + length2 * may_mm2);
        return outward > 0.0 ? may_mm2 / (outward + root) : (root - outward) / length2;
    }
    // It went there.
    void note(glm::dvec3 from_mm, glm::dvec3 to_mm, glm::dvec3 hand_mm) noexcept {
        const glm::dvec3 step = to_mm - from_mm;
        given_mm2_ += glm::dot(step, step + 2.0 * (from_mm - hand_mm));
    }
    void reset() noexcept { given_mm2_ = 0.0; }

 private:
    static constexpr double kKept_s = 0.1;
    double given_mm2_ = 0.0; // below 0: taken
};

} // namespace palpate::haptics
