#include "haptics/safety/passivity.h"

#include <algorithm>

namespace palpate::haptics {

namespace {

// Damping that a stiff spring needs for as long as it is pressed, in k T: a half for the hold and
// the delay in ticks, of which one is granted to devices that state none; and how much of k T it
// comes and goes by in a tick.
constexpr double kHold = 0.5, kLeastDelay = 1.0, kSteadySlew = 0.2;
// Damping that does not oppose the motion of now fades with this time constant: a device sees its
// motion in steps.
constexpr double kFade_s = 0.01;

// The part of a force that opposes the motion, up to most_n; a part that pushes on is left out, and
// of the rest a share stays.
glm::dvec3 opposing(glm::dvec3 force_n, glm::dvec3 direction, double most_n, double rest) {
    const double along_n = -glm::dot(force_n, direction);
    const glm::dvec3 opposes = -std::clamp(along_n, 0.0, most_n) * direction;
    const glm::dvec3 beside = force_n - opposes + std::min(along_n, 0.0) * direction;
    return opposes + rest * beside;
}

} // namespace

// Sent forces stay in memory and are not read any more: a servo without force resets every tick.
void Passivity::reset() noexcept {
    has_last_ = false;
    unseen_s_ = made_j_ = work_j_ = damping_ = steady_ = last_stored_j_ = 0.0;
    slow_n_ = glm::dvec3(0.0);
    count_ = 1;
    sent_[next_] = {};
}

Passivity::Held Passivity::mean(double from_s, double to_s) const noexcept {
    Held mean;
    double begin_s = 0.0; // of an entry, back from now
    for (uint32_t back = 0; back < count_ && begin_s < to_s; ++back) {
        const Sent& sent = sent_[(next_ + kMostSent - back) % kMostSent];
        const double end_s = begin_s + sent.dt_s;
        const double shared_s = std::min(end_s, to_s) - std::max(begin_s, from_s);
        if (shared_s > 0.0) {
            const double share = shared_s / (to_s - from_s);
            mean.force_n += share * sent.force_n;
            mean.damping_n_s_per_m += share * sent.damping_n_s_per_m;
        }
        begin_s = end_s;
    }
    return mean;
}

// The account up to the sample, which is the newest that is known.
void Passivity::observe(glm::dvec3 position_m, double stored_j) noexcept {
    const double delay_s = settings_.delay_s;
    if (has_last_) {
        const glm::dvec3 acted_n = mean(delay_s, delay_s + unseen_s_).force_n;
        const double work_j = glm::dot(acted_n, position_m - last_m_);
        work_j_ += work_j;
        made_j_ += work_j + stored_j - last_stored_j_;
    }
    if (made_j_ < 0.0)
        made_j_ *= std::max(0.0, 1.0 - unseen_s_ / settings_.leak_s);
    made_j_ = std::min(made_j_, settings_.most_j);
    has_last_ = true;
    last_m_ = position_m;
    last_stored_j_ = stored_j;
    unseen_s_ = 0.0;
}

glm::dvec3 Passivity::limit(glm::dvec3 position_m, glm::dvec3 velocity_m_per_s, glm::dvec3 force_n,
                            Spring spring, double dt_s, bool is_fresh) noexcept {
    sent_[next_].dt_s = dt_s;
    unseen_s_ += dt_s;
    if (is_fresh)
        observe(position_m, spring.stored_j);

    const double speed = glm::length(velocity_m_per_s), most = settings_.most_damping_n_s_per_m;
    const glm::dvec3 direction = speed > 0.0 ? velocity_m_per_s / speed : glm::dvec3(0.0);
    double wanted = 0.0; // N s/m
    if (made_j_ > 0.0 && speed > 1e-9) {
        const double unacted_s = settings_.delay_s + unseen_s_;
        const double taken_j = unacted_s * mean(0.0, unacted_s).damping_n_s_per_m * speed * speed;
        wanted = std::clamp((made_j_ - taken_j) / (dt_s * speed * speed), 0.0, most);
    }
    const double spring_damping = spring.stiffness_n_per_m * dt_s;
    const double delay_ticks = std::max(kLeastDelay, settings_.delay_s / dt_s);
    const double most_steady = (kHold + delay_ticks) * spring_damping,
                 most_change = kSteadySlew * spring_damping;
    // It ends with the spring: where there is none, so is none of it.
    steady_ = std::min(most_steady, steady_ + std::clamp(std::min(wanted, most_steady) - steady_,
                                                         -most_change, most_change));
    // The rest of what is wanted.
    const glm::dvec3 change_n = -std::max(0.0, wanted - steady_) * velocity_m_per_s - slow_n_;
    const double step_n = settings_.slew_n_per_s * dt_s, change = glm::length(change_n);
    slow_n_ += change > step_n ? step_n / change * change_n : change_n;
    slow_n_ = opposing(slow_n_, direction, most * speed, std::max(0.0, 1.0 - dt_s / kFade_s));
    const glm::dvec3 damping_n = slow_n_ - steady_ * velocity_m_per_s;
    damping_ = speed > 0.0 ? glm::length(damping_n) / speed : 0.0;
    next_ = (next_ + 1) % kMostSent;
    count_ = std::min(count_ + 1, kMostSent);
    sent_[next_] = {.force_n = force_n + damping_n, .damping_n_s_per_m = damping_};
    return sent_[next_].force_n;
}

double stored_energy_j(double force_n, double stiffness_n_per_m, double most_n) noexcept {
    const double spring_n = std::min(force_n, most_n);
    const double spring_j = spring_n * spring_n / (2.0 * stiffness_n_per_m);
    return spring_j + most_n * std::max(0.0, force_n - most_n) / stiffness_n_per_m;
}

} // namespace palpate::haptics
