#include "haptics/proxy/yielding.h"

#include <algorithm>
#include <limits>

#include "haptics/field/coupling.h"

namespace palpate::haptics {

using glm::dvec3;

double Yielding::speed_mm_per_s(double stiffness) {
    return std::min(kSpeed_mm_per_s, kRate_n_per_s / stiffness);
}

void Yielding::enter(dvec3 proxy, dvec3 normal, dvec3 hand) {
    *this = {};
    is_inside_ = true;
    place_ = proxy;
    hand_ = hand;
    entry_ = normal;
    const dvec3 spring = proxy - hand;
    slack_ = glm::length(spring - glm::dot(spring, normal) * normal);
}

void Yielding::sink(dvec3 hand, double stiffness, double yield_n, double friction, double dt_s) {
    const dvec3 before = place_, whole = place_ - hand;
    const double along = glm::dot(whole, entry_), outward = std::max(0.0, along);
    dvec3 across = whole - along * entry_;
    const double reach = yield_n / stiffness, length_across = glm::length(across);
    const double held = std::max(friction * std::min(outward, reach), slack_);
    if (length_across > held)
        across *= held / length_across;
    slack_ = std::max(0.0, std::min(slack_, length_across) - speed_mm_per_s(stiffness) * dt_s);
    dvec3 spring = outward * entry_ + across;
    const double length = glm::length(spring);
    if (length > reach)
        spring *= std::max(reach, length - kSpeed_mm_per_s * dt_s) / length;
    const dvec3 step = hand + spring - before;
    const double most = glm::distance(hand, hand_) + kSpeed_mm_per_s * dt_s;
    place_ = before + most / std::max({most, glm::length(step), 1e-12}) * step;
    path_ += glm::distance(place_, before);
    hand_ = hand;
}

bool Yielding::stays(bool is_free, double grain_mm, dvec3 hand, double stiffness, double felt_n) {
    was_in_material_ |= !is_free;
    // At the surface, where it entered, it is free to within what geometry errs by.
    if (!is_free || !(was_in_material_ || path_ > grain_mm || felt_n == 0.0))
        return true;
    const dvec3 spring = place_ - hand;
    const double length = glm::length(spring), rendered = felt_n / stiffness;
    lag_ = length > rendered ? (1.0 - rendered / length) * spring : dvec3(0.0);
    is_inside_ = false;
    is_leaving_ = true;
    return false;
}

void Yielding::catch_up(double stiffness, double dt_s) {
    const double length = glm::length(lag_), less = speed_mm_per_s(stiffness) * dt_s;
    lag_ = length > less ? (1.0 - less / length) * lag_ : dvec3(0.0);
    is_leaving_ = lag_ != dvec3(0.0);
}

dvec3 ForceCut::cut(dvec3 force, double yield_n, double dt_s) {
    const double change = Yielding::kRate_n_per_s * dt_s;
    double most = yield_n;
    if (was_cut_)
        most = std::min(most, felt_n_ + change);
    if (yield_n < std::numeric_limits<double>::infinity() || was_cut_)
        most = std::max(most, felt_n_ - change);
    const double length = glm::length(force);
    was_cut_ = length > most;
    felt_n_ = was_cut_ ? most : length;
    return was_cut_ ? most / length * force : force;
}

} // namespace palpate::haptics
