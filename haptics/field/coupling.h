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

// Whether the parameters are finite and within MostTouch.
inline bool is_sane(const LabelTouch& l) {
    const auto within = [](double value, double most) { return value >= 0.0 && value <= most; };
    return within(l.stiffness_n_per_m, MostTouch::stiffness_n_per_m) &&
           within(l.friction_static, MostTouch::friction) &&
           within(l.friction_dynamic, MostTouch::friction) && within(l.yield_n, MostTouch::force_n);
}

inline bool is_sane(const HapticTransfer& t) {
    bool sane = std::abs(t.strength_n) <= MostTouch::force_n &&
                std::abs(t.center) <= MostTouch::value && std::abs(t.width) <= MostTouch::value;
    for (uint32_t i = 0; i < std::min(t.point_count, HapticTransfer::kMostPoints); ++i)
        sane = sane && std::abs(t.forces_n[i]) <= MostTouch::force_n &&
               std::abs(t.values[i]) <= MostTouch::value;
    return sane;
}

inline bool is_sane(const TouchParameters& p) {
    using Most = MostTouch;
    const auto within = [](double value, double most) { return value >= 0.0 && value <= most; };
    bool sane = std::abs(p.iso) <= Most::value && within(p.tool_radius_mm, Most::radius_mm) &&
                within(p.stiffness_n_per_m, Most::stiffness_n_per_m) &&
                within(p.damping_n_s_per_m, Most::damping_n_s_per_m) &&
                within(p.friction_static, Most::friction) &&
                within(p.friction_dynamic, Most::friction) && within(p.yield_n, Most::force_n) &&
                within(p.viscosity_n_s_per_m, Most::damping_n_s_per_m) &&
                within(p.vibration_n, Most::force_n) && within(p.normal_blur_samples, 1.0) &&
                within(p.edge_samples, 1.0) && within(p.surface_delay_s, Most::delay_s) &&
                within(p.drill_threshold_mm, Most::drill_mm);
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
