#include "haptics/servo/parameter_slew.h"

#include <algorithm>

namespace palpate::haptics {

namespace {

bool same_amounts(const TouchParameters& a, const TouchParameters& b) {
    return std::all_of(std::begin(kTouchSettings), std::end(kTouchSettings), [&](const auto& s) {
        return s.use.slew == Slew::none || value_of(s, a) == value_of(s, b);
    });
}

// A value on the way, at a share of it within 0 .. 1.
double between(const Setting<TouchParameters>& setting, double from, double to, double share) {
    if (setting.use.slew == Slew::inverse && (from == 0.0) != (to == 0.0))
        return std::min(setting.most,
                        from == 0.0 ? to / share : from / std::max(1e-9, 1.0 - share));
    return from + share * (to - from);
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
        for (const Setting<TouchParameters>& setting : kTouchSettings)
            if (setting.use.slew != Slew::none)
                set(setting, now_,
                    between(setting, value_of(setting, from_), value_of(setting, target),
                            since_s_ / kWhole_s));
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
