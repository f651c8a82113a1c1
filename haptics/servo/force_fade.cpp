#include "haptics/servo/force_fade.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptics/field/coupling.h"
#include "haptics/safety/stages.h"

namespace palpate::haptics {

double natural_change_n(const TouchParameters& parameters, double moved_mm, double sped_mm_per_s,
                        double removal) noexcept {
    const TouchParameters& p = parameters;
    double stiffness = p.stiffness_n_per_m, friction = p.friction_static;
    for (uint32_t i = 0; i < std::min(p.label_count, TouchParameters::kMostLabels); ++i) {
        stiffness = std::max(stiffness, p.labels[i].stiffness_n_per_m);
        friction = std::max(friction, p.labels[i].friction_static);
    }
    return 1e-3 * (stiffness * std::hypot(1.0, friction) * moved_mm +
                   (p.damping_n_s_per_m + p.viscosity_n_s_per_m + p.air_drag_n_s_per_m) *
                       sped_mm_per_s) +
           2.0 * removal * p.vibration_n; // it is within +-removal * vibration_n
}

void ForceFade::reset() noexcept {
    watch_s_ = 0.0;
    has_last_ = false;
    force_ = torque_ = {};
}

// The difference shrinks by `less`; then the change is limited.
glm::dvec3 ForceFade::Part::next(glm::dvec3 limited, double most_change, double less) noexcept {
    const double length = glm::length(left);
    left = length > less ? left * ((length - less) / length) : glm::dvec3(0.0);
    const glm::dvec3 change = limited + left - last;
    const double whole = glm::length(change);
    if (whole > most_change)
        left -= change * ((whole - most_change) / whole);
    last = limited + left;
    return last;
}

Wrench ForceFade::next(const Wrench& rendered, double natural_n, double dt_s) noexcept {
    if (!is_finite(rendered.force_n) || !is_finite(rendered.torque_nm)) {
        reset();
        return rendered;
    }
    const bool is_watched = watch_s_ > 0.0 && has_last_;
    watch_s_ = std::max(0.0, watch_s_ - dt_s);
    has_last_ = true;
    const double less_n = kRate_n_per_s * dt_s;
    const double natural = natural_n >= 0.0 ? natural_n : 0.0; // of parameters that are none
    const double most_change_n =
        is_watched ? natural + less_n : std::numeric_limits<double>::infinity();
    Wrench out{force_.next(limit_magnitude(rendered.force_n, most_n_), most_change_n, less_n),
               torque_.next(limit_magnitude(rendered.torque_nm, kLever_m * most_n_),
                            kLever_m * most_change_n, kLever_m * less_n)};
    if (!is_watched && force_.left == glm::dvec3(0.0))
        out.force_n = rendered.force_n;
    if (!is_watched && torque_.left == glm::dvec3(0.0))
        out.torque_nm = rendered.torque_nm;
    return out;
}

} // namespace palpate::haptics
