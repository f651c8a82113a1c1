#pragma once

#include "bench/touch/closed_loop.h"
#include "haptics/proxy/algorithms.h"

namespace palpate::touch {

// Measurements of an algorithm in one scene of the plan, a plane of 0.5 mm floats, at 1 N/mm; NaN
// where the algorithm has no such property or never touched.
struct Laws {
    double energy_beyond_mj = NAN;  // in to 4 mm at 0.2 m/s and out: work on the hand less k v T d
    double friction_share = NAN;    // largest |F across| / |F along| while sliding; 0.4 is set
    double stick_drift_um_s = NAN;  // of the proxy, held at half of its friction for a second
    double yield_share = NAN;       // force held where T0 is 2 N, as a share of T0
    double below_yield_share = NAN; // force at 1.9 mm, before it yields, as a share of 1.9 N
    double limit_cycle_um = NAN;    // peak to peak of a falcon held in at 3 mm by a relaxed hand
};
constexpr double kLawFriction = 0.4, kLawYield_n = 2.0;

Laws laws_of(const haptics::AlgorithmEntry& entry);

} // namespace palpate::touch
