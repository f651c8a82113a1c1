#include "haptics/servo/parameter_slew.h"

#include <algorithm>

namespace palpate::haptics {

namespace {

constexpr double TouchParameters::*kAmounts[] = {
    &TouchParameters::iso,
    &TouchParameters::tool_radius_mm,
    &TouchParameters::stiffness_n_per_m,
    &TouchParameters::damping_n_s_per_m,
    &TouchParameters::friction_static,
    &TouchParameters::friction_dynamic,
    &TouchParameters::yield_n,
    &TouchParameters::viscosity_n_s_per_m,
    &TouchParameters::vibration_n,
};

bool same_amounts(const TouchParameters& a, const TouchParameters& b) {
    return std::all_of(std::begin(kAmounts), std::end(kAmounts),
                       [&](auto amount) { return a.*amount == b.*amount; });
}

} // namespace

const TouchParameters& ParameterSlew::step(const TouchParameters& target, double dt_s,
                                           double most_n_per_m) noexcept {
    if (!has_any_) {
        has_any_ = true;
        from_ = to_ = now_ = target;
        since_s_ = kWhole_s;
    } else if (!same_amounts(to_, target)) {
        from_ = now_;
        since_s_ = 0.0;
    }
    to_ = target;
    since_s_ = std::min(kWhole_s, since_s_ + dt_s);
    now_ = target;
    if (since_s_ < kWhole_s)
        for (const auto amount : kAmounts)
            now_.*amount = from_.*amount + since_s_ / kWhole_s * (target.*amount - from_.*amount);
    // 0 is never, farther than any force: the way there leads through 1 / T0, what material gives.
    if (since_s_ < kWhole_s && (from_.yield_n == 0.0) != (target.yield_n == 0.0)) {
        const double share = since_s_ / kWhole_s;
        now_.yield_n = from_.yield_n == 0.0 ? target.yield_n / share
                                            : from_.yield_n / std::max(1e-9, 1.0 - share);
        now_.yield_n = std::min(now_.yield_n, MostTouch::force_n);
    }
    is_softened_ = false;
    const auto soften = [&](double& stiffness) {
        is_softened_ |= stiffness > most_n_per_m;
        stiffness = std::min(stiffness, most_n_per_m);
    };
    given_ = now_;
    soften(given_.stiffness_n_per_m);
    for (uint32_t i = 0; i < std::min(given_.label_count, TouchParameters::kMostLabels); ++i)
        soften(given_.labels[i].stiffness_n_per_m);
    return given_;
}

} // namespace palpate::haptics
