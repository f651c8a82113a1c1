#include "haptics/safety/passivity.h"

#include <algorithm>
#include <cmath>

#include "haptics/safety/stages.h"

namespace palpate::haptics {

namespace {

constexpr double kForget_s = 0.01; // how long motion is remembered, where a device sees it in steps

} // namespace

glm::dvec3 Passivity::limit(glm::dvec3 position_m, glm::dvec3 velocity_m_per_s, glm::dvec3 force_n,
                            double stored_j, double dt_s) noexcept {
    const glm::dvec3 way_m = has_last_ ? position_m - last_m_ : glm::dvec3(0.0);
    const double work_j = glm::dot(sent_n_, way_m);
    work_j_ += work_j;
    made_j_ += work_j + (has_last_ ? stored_j - last_stored_j_ : 0.0);
    if (made_j_ < 0.0)
        made_j_ *= std::max(0.0, 1.0 - dt_s / settings_.leak_s);
    made_j_ = std::min(made_j_, settings_.most_j);
    has_last_ = true;
    last_m_ = position_m;
    last_stored_j_ = stored_j;

    const double speed2 = glm::dot(velocity_m_per_s, velocity_m_per_s);
    damping_ = 0.0;
    if (made_j_ > 0.0 && speed2 > 0.0)
        damping_ = std::min(settings_.most_damping_n_s_per_m, made_j_ / (dt_s * speed2));
    const glm::dvec3 change_n = -damping_ * velocity_m_per_s - damping_n_;
    const double most_n = settings_.slew_n_per_s * dt_s, change = glm::length(change_n);
    damping_n_ += change > most_n ? most_n / change * change_n : change_n;
    // It never pushes on, and ends with the motion that it damps.
    speed_ = std::max(std::sqrt(speed2), speed_ * std::max(0.0, 1.0 - dt_s / kForget_s));
    damping_n_ = limit_magnitude(damping_n_, settings_.most_damping_n_s_per_m * speed_);
    if (const double along = glm::dot(damping_n_, velocity_m_per_s); along > 0.0)
        damping_n_ -= along / speed2 * velocity_m_per_s;
    return force_n + damping_n_;
}

double stored_energy_j(double force_n, double stiffness_n_per_m, double most_n) noexcept {
    const double spring_n = std::min(force_n, most_n);
    const double spring_j = spring_n * spring_n / (2.0 * stiffness_n_per_m);
    return spring_j + most_n * std::max(0.0, force_n - most_n) / stiffness_n_per_m;
}

} // namespace palpate::haptics
