#pragma once

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// Slews parameters in steps that a hand does not feel: from current to new values in
// 20 ms, 5 % of the change a millisecond, as the rows of kTouchSettings say. Counts, switches and
// tables change at once.
class ParameterSlew {
 public:
    static constexpr double kWhole_s = 0.020;

    // The parameters of this tick, on the way to `target`; the first are taken as they are. No
    // coupling, of a label either, is stiffer than most_n_per_m.
    const TouchParameters& step(const TouchParameters& target, double dt_s,
                                double most_n_per_m = MostTouch::stiffness_n_per_m) noexcept;
    bool is_softened() const noexcept { return is_softened_; } // one would have been

 private:
    bool has_any_ = false;
    TouchParameters from_, to_, now_, given_;
    double since_s_ = 0.0;
    bool is_softened_ = false;
};

} // namespace palpate::haptics
