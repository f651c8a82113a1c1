#pragma once

#include <algorithm>
#include <cmath>

#include "haptics/field/algorithm.h"

// Small things that every algorithm needs.
namespace palpate::haptics {

inline bool is_finite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Within 10 km of the origin.
inline bool is_place(glm::dvec3 mm) {
    return is_finite(mm) && glm::length(mm) < 1e7;
}

// Whether the numbers are finite and within the limits of the table. Counts are not looked at: who
// reads one bounds it.
template <class Struct>
bool is_within(const Struct& in, std::span<const Setting<Struct>> settings) {
    return std::all_of(settings.begin(), settings.end(), [&](const Setting<Struct>& setting) {
        return is_whole(setting) || allows(setting, value_of(setting, in));
    });
}

inline bool is_sane(const LabelTouch& label) {
    return is_within<LabelTouch>(label, kLabelSettings);
}

inline bool is_sane(const HapticTransfer& t) {
    bool sane = is_within<HapticTransfer>(t, kTransferSettings);
    for (uint32_t i = 0; i < std::min(t.point_count, HapticTransfer::kMostPoints); ++i)
        sane = sane && std::abs(t.forces_n[i]) <= MostTouch::force_n &&
               std::abs(t.values[i]) <= MostTouch::value;
    return sane;
}

inline bool is_sane(const TouchParameters& p) {
    bool sane = is_within<TouchParameters>(p, kTouchSettings);
    for (const HapticTransfer& t : {p.transfer[0], p.transfer[1], p.transfer[2], p.opacity})
        sane = sane && is_sane(t);
    for (uint32_t i = 0; i < std::min(p.label_count, TouchParameters::kMostLabels); ++i)
        sane = sane && is_sane(p.labels[i]);
    return sane;
}

// Everything an algorithm calculates with is a number, and lengths are of this world: beyond 10 km
// or 1 km/s, differences of doubles say nothing of micrometres.
inline bool is_sane(const TickInput& input) {
    const glm::dvec3 x = input.tool.position_mm, v = input.velocity_mm_per_s;
    return is_place(x) && is_finite(v) && glm::length(v) < 1e6 && input.dt_s >= 1e-6 &&
           input.dt_s < 1.0 && input.removal >= 0.0 && input.removal <= 1.0 &&
           is_sane(*input.parameters);
}

// The answer to an input that is not.
inline TickOutput unknown_output(glm::dvec3 last_proxy_mm) {
    TickOutput output;
    output.proxy.position_mm = last_proxy_mm;
    output.contact = Contact::unknown;
    output.confidence = 0.0;
    return output;
}

// f = -k (x - p) - gamma (x' - p'), in newtons: the coupling of all five papers.
inline glm::dvec3 coupling_n(double stiffness_n_per_m, double damping_n_s_per_m, glm::dvec3 tool_mm,
                             glm::dvec3 proxy_mm, glm::dvec3 tool_mm_per_s,
                             glm::dvec3 proxy_mm_per_s) {
    return -1e-3 * (stiffness_n_per_m * (tool_mm - proxy_mm) +
                    damping_n_s_per_m * (tool_mm_per_s - proxy_mm_per_s));
}

// Unit length, or 0 where there is no direction.
inline glm::dvec3 unit_or_zero(glm::dvec3 v) {
    const double length = glm::length(v);
    return length > 1e-12 && std::isfinite(length) ? v / length : glm::dvec3(0.0);
}

// A stream of 32-bit numbers out of 64 bits of state: splitmix64 (Steele, Lea & Flood 2014).
inline uint32_t next_random(uint64_t& state) {
    uint64_t z = (state += 0x9e3779b97f4a7c15u);
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return static_cast<uint32_t>((z ^ z >> 31) >> 32);
}
// -1 .. 1
inline double next_signed(uint64_t& state) {
    return static_cast<double>(next_random(state)) * 0x1p-31 - 1.0;
}

} // namespace palpate::haptics
