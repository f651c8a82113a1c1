#include "haptics/safety/chain.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/assert.h"

namespace palpate::haptics {

namespace {

constexpr double kNsPerS = 1e9;
constexpr double kShortest_s = 1e-5, kLongest_s = 0.1; // of a tick, for whoever divides by it
constexpr double kFadeIn_s = 0.1;                      // after a late tick
constexpr double kSettle_s = 0.01;                     // in which damping of swings comes and goes
constexpr double kDampingShare = 0.1; // of soft start, from which on all of its damping acts

bool finite(glm::dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

double smaller_limit(double own, double device, double share) {
    return device > 0.0 ? std::min(own, share * device) : 0.0;
}

double most_damping(const SafetyLimits& limits, const DeviceCapabilities& device) {
    const double most = device.max_damping_n_s_per_m;
    return most > 0.0 ? std::min(limits.passivity_damping_n_s_per_m, most)
                      : limits.passivity_damping_n_s_per_m;
}

} // namespace

double most_force_n(const SafetyLimits& limits, const DeviceCapabilities& device) noexcept {
    return smaller_limit(limits.most_force_n, device.max_force_n, limits.device_share);
}

double most_stiffness_n_per_m(const SafetyLimits& limits, const DeviceCapabilities& device,
                              double rate_hz) noexcept {
    const double stable =
        most_damping(limits, device) / (0.5 / rate_hz + std::max(0.0, device.delay_s));
    const double makers = device.max_stiffness_n_per_m;
    return makers > 0.0 ? std::min(makers, stable) : stable;
}

Passivity::Settings passivity_settings(const SafetyLimits& limits,
                                       const DeviceCapabilities& device) noexcept {
    return {.most_damping_n_s_per_m = most_damping(limits, device),
            .leak_s = limits.passivity_leak_s,
            .slew_n_per_s = limits.passivity_slew_n_per_s,
            .delay_s = std::max(0.0, device.delay_s)};
}

std::string fault_text(uint32_t faults) {
    constexpr std::pair<uint32_t, const char*> kNames[] = {
        {kFaultInput, "input"},       {kFaultGone, "device gone"}, {kFaultNotFinite, "not finite"},
        {kFaultVelocity, "velocity"}, {kFaultShaking, "shaking"},  {kFaultHeld, "held"},
        {kFaultLate, "late"},         {kFaultTooLate, "too late"}, {kFaultSoftened, "softened"},
        {kFaultDamped, "damped"}};
    std::string text;
    for (const auto& [bit, name] : kNames)
        if (faults & bit)
            text += (text.empty() ? "" : ", ") + std::string(name);
    return text.empty() ? "none" : text;
}

SafetyChain::SafetyChain(const SafetyLimits& limits, const DeviceCapabilities& device,
                         double rate_hz)
    : limits_(limits),
      device_(device),
      most_n_(haptics::most_force_n(limits, device)),
      most_nm_(smaller_limit(limits.most_torque_nm, device.max_torque_nm, limits.device_share)),
      passivity_(passivity_settings(limits, device)),
      self_driven_(std::max(0.0, device.delay_s)),
      dt_s_(1.0 / rate_hz),
      period_ns_(static_cast<int64_t>(kNsPerS / rate_hz)),
      history_(static_cast<size_t>(std::ceil(limits.history_s * rate_hz))) {
    PALPATE_ASSERT(rate_hz > 0.0 && !history_.empty());
}

void SafetyChain::arm() noexcept {
    faults_ = 0;
    fade_ = 1.0;
    closed_ = false;
    input_.reset();
    passivity_.reset();
    impulse_.reset();
    shaking_.reset();
    self_driven_.reset();
    taken_ns_ = last_ns_;
    start_.disarm();
    start_.arm();
}

void SafetyChain::latch(uint32_t fault) noexcept {
    faults_ |= fault;
}

SafetyChain::Begun SafetyChain::begin(int64_t now_ns, int64_t due_ns, DeviceStatus status,
                                      const DeviceSample& sample) noexcept {
    faults_ &= kFaultLatched;
    now_ = {.now_ns = now_ns, .status = status, .sample = sample};
    if (has_last_)
        dt_s_ =
            std::clamp(static_cast<double>(now_ns - last_ns_) / kNsPerS, kShortest_s, kLongest_s);
    // A thread that hung within a tick begins the next one on schedule, but long after the last.
    int64_t late_ns = now_ns - due_ns;
    if (has_last_)
        late_ns = std::max(late_ns, now_ns - last_ns_ - period_ns_);
    last_ns_ = now_ns;
    has_last_ = true;
    // Nor does a tick without the sample that it waited for come in time.
    silence_ns_ =
        device_.paces && status == DeviceStatus::stale ? input_.silence_ns(device_, now_ns) : 0;
    late_ns = std::max(late_ns, silence_ns_);

    if (std::exchange(halted_, false) || late_ns > limits_.too_late_ns) { // 9
        faults_ |= kFaultTooLate;
        start_.again();
    } else if (late_ns > limits_.late_ns) {
        faults_ |= kFaultLate;
    }

    Begun begun{.sample = sample};
    switch (input_.check(limits_, device_, now_ns, status, begun.sample)) {
        case InputCheck::Verdict::good:
            begun.usable = begun.fresh = true;
            break;
        case InputCheck::Verdict::held:
            faults_ |= kFaultHeld;
            begun.usable = true;
            break;
        case InputCheck::Verdict::lost:
            if (start_.mode() != SoftStart::Mode::disarmed)
                latch(status == DeviceStatus::gone    ? kFaultGone
                      : status == DeviceStatus::ended ? 0u
                                                      : kFaultInput);
            break;
        case InputCheck::Verdict::absent:
            break;
    }
    const bool pressed = begun.usable && (begun.sample.buttons >> limits_.dead_man_button & 1) != 0;
    ready_ = begun.usable && (pressed || !limits_.needs_dead_man);
    usable_ = begun.usable;
    is_fresh_ = begun.fresh;
    used_ = begun.sample;
    return begun;
}

Wrench SafetyChain::finish(const Wrench& wanted, double stiffness_n_per_m) noexcept {
    now_.wanted = wanted;
    Wrench sent = wanted;
    if (!finite(wanted.force_n) || !finite(wanted.torque_nm)) { // 3
        latch(kFaultNotFinite);
        sent = {};
    }
    const double rendered_n = glm::length(limit_magnitude(sent.force_n, 1e6));
    now_.share = start_.share(limits_, ready_, rendered_n, dt_s_); // 2
    if (latched() && !(faults_ & kFaultVelocity))
        now_.share = 0.0;
    // The ramp's damping comes with the first of the force: a hand may be on its way already.
    const double damping = limits_.ramp_damping_n_s_per_m * (1.0 - now_.share) *
                           std::min(1.0, now_.share / kDampingShare);
    damping_n_ = 0.0;
    const double lever_m = limits_.lever_m;
    sent.torque_nm =
        limit_slew(lever_m * limits_.rise_n_per_s, lever_m * limits_.fall_n_per_s, sent_.torque_nm,
                   limit_magnitude(now_.share * sent.torque_nm, most_nm_), dt_s_); // 6

    const bool open = usable_ && !latched() && now_.share > 0.0;
    if (open) {
        const glm::dvec3 proxy_n = now_.share * sent.force_n;
        // No more than the force that it is added to, so that it never holds a hand back.
        const double settling =
            std::min(self_driven_.settling_n_s_per_m(), most_damping(limits_, device_));
        faults_ |= settling > 0.0 ? kFaultDamped : 0u;
        settling_ += (settling - settling_) * std::min(1.0, dt_s_ / kSettle_s);
        sent.force_n = proxy_n - damping * used_.velocity_m_per_s -
                       limit_magnitude(settling_ * used_.velocity_m_per_s, glm::length(proxy_n));
        const double stored_j =
            stiffness_n_per_m > 0.0
                ? stored_energy_j(now_.share * rendered_n, now_.share * stiffness_n_per_m, most_n_)
                : 0.0;
        sent.force_n = passivity_.limit(used_.position_m, used_.velocity_m_per_s, sent.force_n,
                                        {stored_j, now_.share * stiffness_n_per_m}, dt_s_,
                                        is_fresh_); // 4
        damping_n_ = glm::length(sent.force_n - proxy_n);
        sent.force_n =
            limit_magnitude(sent.force_n, std::min(most_n_, heat_.most(limits_, most_n_)));
        sent.force_n = impulse_.limit(sent.force_n, most_n_, limits_.impulse_s, dt_s_); // 6
        sent.force_n = limit_slew(limits_.rise_n_per_s, limits_.fall_n_per_s, sent_.force_n,
                                  sent.force_n, dt_s_);
    } else {
        passivity_.reset();
        settling_ = 0.0;
        sent = {};
    }

    // 8: what went out before is what pushed the hand to this speed.
    const glm::dvec3 measured = input_.velocity_m_per_s();
    const double speed = std::max(glm::length(used_.velocity_m_per_s), glm::length(measured));
    if (open && speed > limits_.trip_speed_m_per_s &&
        glm::length(sent_.force_n) > limits_.trip_force_share * most_n_)
        latch(kFaultVelocity);
    const bool shakes = shaking_.shakes(limits_, measured, sent_.force_n, dt_s_); // 4
    bool is_driven = false;
    if (open)
        is_driven = self_driven_.drives(used_.position_m, sent_.force_n, dt_s_, is_fresh_) ||
                    (self_driven_.seems_driven() && shaking_.turns() > limits_.shake_few_turns);
    else
        self_driven_.reset();
    if (shakes || is_driven)
        latch(kFaultShaking);
    if ((faults_ & kFaultLatched) == kFaultVelocity) {
        const double step_n = most_n_ * dt_s_ / limits_.trip_ramp_s;
        const double left_n = std::max(0.0, glm::length(sent_.force_n) - step_n);
        sent.force_n = limit_magnitude(sent_.force_n, left_n);
        sent.torque_nm = glm::dvec3(0.0);
    } else if (latched() || (faults_ & kFaultTooLate)) {
        sent = {};
    }
    // 9: a late tick takes force down, and time on schedule brings it back.
    fade_ = std::clamp(
        faults_ & kFaultLate ? fade_ - dt_s_ / limits_.trip_ramp_s : fade_ + dt_s_ / kFadeIn_s, 0.0,
        1.0);
    if (silence_ns_ > limits_.late_ns) // evenly to nothing where it would be too late
        fade_ = std::clamp(static_cast<double>(limits_.too_late_ns - silence_ns_) /
                               static_cast<double>(limits_.too_late_ns - limits_.late_ns),
                           0.0, fade_);
    sent.force_n *= fade_;
    sent.torque_nm *= fade_;

    sent_ = sent;
    passivity_.sent(sent.force_n);
    impulse_.sent(sent.force_n, dt_s_);
    if (most_n_ > 0.0)
        heat_.sent(limits_, glm::length(sent.force_n), most_n_, dt_s_); // 7
    now_.sent = sent;
    now_.faults = faults_;
    if (!closed_) // 10
        history_[written_++ % history_.size()] = now_;
    closed_ = latched();
    return sent;
}

void SafetyChain::written(DeviceStatus status) noexcept {
    const bool is_taken = status != DeviceStatus::stale || sent_ == Wrench{};
    if (is_taken)
        taken_ns_ = last_ns_;
    if (start_.mode() != SoftStart::Mode::disarmed &&
        (status == DeviceStatus::gone || last_ns_ - taken_ns_ > limits_.hold_ns))
        latch(kFaultGone);
}

std::vector<SafetyRecord> SafetyChain::history() const {
    const size_t count = std::min(written_, history_.size());
    std::vector<SafetyRecord> records;
    records.reserve(count);
    for (size_t i = written_ - count; i < written_; ++i)
        records.push_back(history_[i % history_.size()]);
    return records;
}

} // namespace palpate::haptics
