#include "haptics/safety/stages.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

namespace {

constexpr double kNsPerSecond = 1e9;

bool is_finite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool is_finite(glm::dquat q) {
    return std::isfinite(q.w) && std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z);
}

// A rotation whose length says that it is one.
bool is_unit(glm::dquat q) {
    return is_finite(q) && std::abs(glm::dot(q, q) - 1.0) < 1e-3;
}

} // namespace

InputCheck::Verdict InputCheck::check(const SafetyLimits& limits, const DeviceCapabilities& device,
                                      int64_t now_ns, DeviceStatus status,
                                      DeviceSample& sample) noexcept {
    if (status == DeviceStatus::gone || status == DeviceStatus::ended)
        return Verdict::lost;
    if (status == DeviceStatus::not_homed) {
        has_good_ = false;
        return Verdict::absent;
    }
    if (status == DeviceStatus::stale && device.paces && has_good_) {
        // Nothing wrong came, but nothing: force fades meanwhile (chain.h).
        if (silence_ns(device, now_ns) > limits.too_late_ns) {
            has_good_ = false;
            return Verdict::absent;
        }
        return hold(now_ns, sample);
    }
    const auto period_ns = static_cast<int64_t>(kNsPerSecond / device.rate_hz);
    const bool is_new = sample.time_ns >= now_ns - limits.hold_ns - period_ns &&
                        sample.time_ns <= now_ns + limits.hold_ns;
    bool good = status == DeviceStatus::ok && is_new && is_finite(sample.position_m) &&
                is_finite(sample.velocity_m_per_s) && is_unit(sample.rotation);
    for (int axis = 0; good && axis < 3; ++axis)
        good = std::abs(sample.position_m[axis]) <= device.workspace_m[axis] + limits.outside_m;
    good = good && glm::length(sample.velocity_m_per_s) <= limits.most_speed_m_per_s;
    // A sample of the same time as the last may differ from it by nothing.
    const double since_s = has_good_ && good
                               ? static_cast<double>(sample.time_ns - good_.time_ns) / kNsPerSecond
                               : 0.0;
    const glm::dvec3 way_m = sample.position_m - good_.position_m;
    if (good && has_good_)
        good = since_s >= 0.0 &&
               glm::length(way_m) <= limits.most_speed_m_per_s * since_s + device.resolution_m;
    if (good) {
        if (!has_good_)
            velocity_m_per_s_ = glm::dvec3(0.0);
        else if (since_s > 0.0)
            velocity_m_per_s_ +=
                -std::expm1(-since_s / limits.speed_s) * (way_m / since_s - velocity_m_per_s_);
        good_ = sample;
        has_good_ = true;
        return Verdict::good;
    }
    if (!has_good_)
        return Verdict::absent;
    if (now_ns < good_.time_ns || now_ns - good_.time_ns > limits.hold_ns)
        return Verdict::lost;
    return hold(now_ns, sample);
}

InputCheck::Verdict InputCheck::hold(int64_t now_ns, DeviceSample& sample) const noexcept {
    sample = good_;
    sample.time_ns = now_ns;
    sample.velocity_m_per_s = glm::dvec3(0.0); // of a hand that is not seen, nothing is known
    return Verdict::held;
}

int64_t InputCheck::silence_ns(const DeviceCapabilities& device, int64_t now_ns) const noexcept {
    const auto period_ns = static_cast<int64_t>(kNsPerSecond / device.rate_hz);
    return has_good_ ? std::max<int64_t>(0, now_ns - good_.time_ns - period_ns) : 0;
}

void SoftStart::again() noexcept {
    if (mode_ == Mode::disarmed)
        return;
    mode_ = Mode::waiting;
    quiet_ticks_ = 0;
    share_ = 0.0;
}

double SoftStart::share(const SafetyLimits& limits, bool ready, double rendered_n,
                        double dt_s) noexcept {
    if (mode_ == Mode::disarmed) {
        quiet_ticks_ = 0;
        return share_ = 0.0;
    }
    if (!ready) { // fades, then waits again
        mode_ = Mode::waiting;
        quiet_ticks_ = 0;
        return share_ = std::max(0.0, share_ - dt_s / limits.trip_ramp_s);
    }
    if (mode_ == Mode::waiting) {
        share_ = std::max(0.0, share_ - dt_s / limits.trip_ramp_s);
        quiet_ticks_ = rendered_n < limits.start_force_n ? quiet_ticks_ + 1 : 0;
        if (quiet_ticks_ >= limits.start_ticks && share_ == 0.0)
            mode_ = Mode::ramping;
        return share_;
    }
    if (mode_ == Mode::ramping) {
        share_ = std::min(1.0, share_ + dt_s / limits.ramp_s);
        if (share_ == 1.0)
            mode_ = Mode::running;
    }
    return share_;
}

bool Shaking::shakes(const SafetyLimits& limits, glm::dvec3 velocity_m_per_s, glm::dvec3 sent_n,
                     double dt_s) noexcept {
    turns_ = std::max(0.0, turns_ - limits.shake_turns_per_s * dt_s);
    force_n_ = std::max(force_n_, glm::length(sent_n));
    const double speed = glm::length(velocity_m_per_s);
    if (speed >= limits.shake_speed_m_per_s) {
        if (glm::dot(velocity_m_per_s, swing_m_per_s_) < 0.0) {
            const double swung = glm::length(swing_m_per_s_);
            turns_ +=
                force_n_ >= limits.shake_force_n && swung >= limits.shake_kept * before_m_per_s_[1];
            before_m_per_s_ = {swung, before_m_per_s_[0]};
            force_n_ = glm::length(sent_n);
            swing_m_per_s_ = velocity_m_per_s;
        } else if (speed > glm::length(swing_m_per_s_)) {
            swing_m_per_s_ = velocity_m_per_s;
        }
    }
    return turns_ >= limits.shake_turns;
}

glm::dvec3 limit_magnitude(glm::dvec3 vector, double most) noexcept {
    if (!is_finite(vector))
        return glm::dvec3(0.0);
    // Divided first, so that squares of the largest doubles do not overflow.
    const double largest = std::max({std::abs(vector.x), std::abs(vector.y), std::abs(vector.z)});
    if (largest == 0.0)
        return vector;
    const glm::dvec3 direction = vector / largest;
    const double length = largest * glm::length(direction);
    return length > most ? direction * (most / glm::length(direction)) : vector;
}

glm::dvec3 ImpulseLimit::limit(glm::dvec3 force_n, double most_n, double window_s,
                               double dt_s) noexcept {
    bin_s_ = window_s / kBins;
    in_bin_s_ += dt_s;
    while (in_bin_s_ >= bin_s_) {
        in_bin_s_ -= bin_s_;
        bin_ = (bin_ + 1) % bins_.size();
        bins_[bin_] = 0.0;
        if (in_bin_s_ > window_s) // nothing of the window is left
            in_bin_s_ = window_s;
    }
    double sum = -bins_[(bin_ + 1) % bins_.size()] * in_bin_s_ / bin_s_;
    for (const double bin : bins_)
        sum += bin;
    constexpr double kKnee = 0.2;
    const double room = 1.0 - sum / (most_n * window_s);
    return room < kKnee ? force_n * std::max(0.0, room / kKnee) : force_n;
}

void ImpulseLimit::sent(glm::dvec3 force_n, double dt_s) noexcept {
    bins_[bin_] += glm::length(force_n) * dt_s;
}

glm::dvec3 limit_slew(double rise, double fall, glm::dvec3 before, glm::dvec3 wanted,
                      double dt_s) noexcept {
    const glm::dvec3 change = wanted - before;
    const double was = glm::length(before);
    if (glm::length(wanted) >= was)
        return before + limit_magnitude(change, rise * dt_s);
    const glm::dvec3 direction = before / was;
    const double let_go = std::clamp(-glm::dot(change, direction), 0.0, was);
    const double made = glm::length(change + let_go * direction);
    const double ticks = (let_go / fall + made / rise) / dt_s;
    return ticks > 1.0 ? before + change / ticks : wanted;
}

double Heat::most(const SafetyLimits& limits, double most_n) const noexcept {
    const double over = std::clamp((level_ - 1.0) / 0.2, 0.0, 1.0);
    return most_n * (1.0 - over * (1.0 - limits.continuous_share));
}

void Heat::sent(const SafetyLimits& limits, double force_n, double most_n, double dt_s) noexcept {
    const double load = force_n / (limits.continuous_share * most_n);
    level_ += (load * load - level_) * std::min(1.0, dt_s / limits.heat_s);
}

} // namespace palpate::haptics
