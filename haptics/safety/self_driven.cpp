#include "haptics/safety/self_driven.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::haptics {

namespace {

constexpr double kForget_s = 0.12; // a cycle of 8 Hz, the fastest that a hand makes by will
constexpr double kPoint_s = 1e-3;  // between points, at least
constexpr double kReach_s = 8e-3;  // of a difference, at least: an eighth of a cycle of 16 Hz
// A motion that counts: within a time, in which a cycle of 3 Hz has three reversals, above a speed
// that tremor does not reach (limits.h), and with more force than half of a sine's of 1 N from peak
// to peak; root mean squares.
constexpr double kTurns_s = 0.5, kSpeed_m_per_s = 0.02, kForce_n = 0.18;
constexpr double kBetter = 0.5; // at fast ticks (better_at)
// A motion is driven where each delay that fits says so: each that leaves less than 1 / better_at()
// of what the best one does. The power factor must be more than the phase that half a tick and half
// a step of the delays make. Or where the best one says so and its power factor is more than that
// phase of half a tick, and of a whole step at 16 Hz: the best may be a neighbour of the true one,
// and what is faster reverses twice as often as a hand, and is counted (stages.h). What may be left
// unexplained is measured, on the first 2000 hands of limit_cycles_cases.h: with 0.04, three that
// tap by will were taken for driven, with 0.035 one, and with 0.03 a loop of the grid there went on
// for 0.7 s.
constexpr double kLag_s = 1e-3;
constexpr double kPowerFactor = 2.0 * std::numbers::pi * 16.0 * kLag_s;
constexpr double kUnexplained = 0.035, kUnexplainedPower = 0.15;
// Ticks of 10 ms hold each force for so long that a hand's motion, too, has a power factor of 0.3
// at 7 Hz. There the motion is driven where the force gives at least twice of what muscles can
// give.
constexpr double kOverMuscles = 2.0;
// Below: where it seems to be. That is asked of a motion that reverses more often than a hand's by
// will; at 8 Hz, swings of 2 mm have so much speed.
constexpr double kSeemsPowerFactor = 0.03, kSeemsUnexplained = 0.15;
constexpr double kSeemsSpeed_m_per_s = 2.0 * std::numbers::pi * 8.0 * 1e-3 / std::numbers::sqrt2;

// Swings that are damped: half of what counts as large, 0.5 mm from turn to turn, at 3 Hz.
constexpr double kSmallSpeed_m_per_s = 2.0 * std::numbers::pi * 3.0 * 0.25e-3;
// A damping b whose force acts a time t late is stable on a mass m up to b = m pi / (2 t). Half of
// that, for the longest delay that is looked for and 5 ms in which a speed is measured.
constexpr double kSettling_per_s = std::numbers::pi / 4.0 / (SelfDriven::kMostDelay_s + 0.005);

template <size_t N>
using Matrix = std::array<std::array<double, N>, N>;

// The lower triangle of Cholesky's decomposition in place of A, which is positive definite.
template <size_t N>
void decompose(Matrix<N>& a) {
    for (size_t j = 0; j < N; ++j)
        for (size_t i = j; i < N; ++i) {
            for (size_t k = 0; k < j; ++k)
                a[i][j] -= a[i][k] * a[j][k];
            a[i][j] = i == j ? std::sqrt(std::max(a[i][j], 1e-12)) : a[i][j] / a[j][j];
        }
}
// L^-1 b: its squares are what each term explains beyond those before it.
template <size_t N>
std::array<double, N> forward(const Matrix<N>& l, std::array<double, N> b) {
    for (size_t i = 0; i < N; ++i) {
        for (size_t k = 0; k < i; ++k)
            b[i] -= l[i][k] * b[k];
        b[i] /= l[i][i];
    }
    return b;
}
// The solution for the first `count` terms, where the others are left out; 0 for these.
template <size_t N>
std::array<double, N> backward(const Matrix<N>& l, std::array<double, N> y, size_t count) {
    std::fill(y.begin() + static_cast<std::ptrdiff_t>(count), y.end(), 0.0);
    for (size_t i = count; i-- > 0;) {
        for (size_t k = i + 1; k < count; ++k)
            y[i] -= l[k][i] * y[k];
        y[i] /= l[i][i];
    }
    return y;
}

// The second derivative under a triangle: twice the second divided difference.
glm::dvec3 bend(const std::array<glm::dvec3, 3>& y, const std::array<double, 3>& t) {
    return 2.0 * ((y[0] - y[1]) / (t[0] - t[1]) - (y[1] - y[2]) / (t[1] - t[2])) / (t[0] - t[2]);
}

// The share of another delay's residual that a better one may leave, for ticks of a length. The
// likelihood of a fit goes as its residual to the power of minus half its degrees of freedom, and
// the bar is one ratio of likelihoods, that of kBetter with fast ticks. A memory of kForget_s has
// as many values as an even one of twice that. Four coefficients and a mean take five. Values under
// a triangle with slopes of h are worth one in 1.08 h, the integral of the square of their
// correlation; where a slope is one tick, the force has two held values under it, worth one in 1.5.
double better_at(double tick_s) noexcept {
    const auto freedom = [](double independent_s) { return 2.0 * kForget_s / independent_s - 5.0; };
    constexpr double kTriangle = 1.08, kTwo = 1.5;
    const double slope_s = tick_s * std::max(1.0, std::ceil(kReach_s / tick_s - 1e-6));
    const double slow = freedom(std::max(kTriangle * slope_s, kTwo * tick_s));
    const double fast = freedom(kTriangle * kReach_s);
    return std::pow(kBetter, std::max(1.0, fast / std::max(1.0, slow)));
}

} // namespace

SelfDriven::SelfDriven(double stated_delay_s) noexcept {
    lags_s_[0] = std::min(stated_delay_s, kMostStated_s);
    for (uint32_t i = 1; i < kLags; ++i)
        lags_s_[i] = kLag_s * (i - 1);
}

// The double integral of the force; exact for a force that is held between points.
glm::dvec3 SelfDriven::twice_at(double time_s) const noexcept {
    // Points are kPoint_s apart at least, so that none further back than this is newer.
    const double most = (now_.time_s - time_s) / kPoint_s + 1.0;
    uint32_t i = std::min(count_ - 2, static_cast<uint32_t>(std::max(0.0, most)));
    while (i > 0 && back(i).time_s <= time_s)
        --i;
    const Point &from = back(i + 1), &to = back(i);
    const double share_s = time_s - from.time_s;
    const glm::dvec3 force = (to.once - from.once) / (to.time_s - from.time_s);
    return from.twice + share_s * (from.once + 0.5 * share_s * force);
}

// Takes away all that is linear in time: it makes no second difference, and would grow for ever.
void SelfDriven::rebase() noexcept {
    const Point origin = now_;
    const auto shift = [&](Point& p) {
        p.time_s -= origin.time_s;
        p.twice -= origin.twice + p.time_s * origin.once;
        p.once -= origin.once;
    };
    std::for_each(points_.begin(), points_.end(), shift);
    shift(now_);
}

bool SelfDriven::drives(glm::dvec3 position_m, glm::dvec3 held_n, double dt_s,
                        bool is_fresh) noexcept {
    now_.twice += dt_s * (now_.once + 0.5 * dt_s * held_n);
    now_.once += dt_s * held_n;
    now_.time_s += dt_s;
    now_.position_m = position_m;
    clock_s_ += dt_s;
    if (!is_fresh)
        return false;
    const double passed_s = count_ > 0 ? now_.time_s - back(0).time_s : kPoint_s;
    if (passed_s < kPoint_s * (1.0 - 1e-6))
        return false;
    points_[next_] = now_;
    next_ = (next_ + 1) % kPoints;
    count_ = std::min(count_ + 1, kPoints);
    const bool is_new = take_in(passed_s);
    seems_driven_ = false;
    settling_ = 0.0;
    if (next_ == 0)
        rebase();
    if (!is_new || !small_turns_.are_often(clock_s_))
        return false;
    solve(dt_s);
    settling_ = std::max(0.0, kSettling_per_s * fit_.mass_kg);
    if (!turns_.are_often(clock_s_))
        return false;
    if (fit_.mass_kg <= 0.0 || fit_.force_n < kForce_n || fit_.speed_m_per_s < kSpeed_m_per_s)
        return false;
    const double unexplained = 1.0 - fit_.explained;
    seems_driven_ = unexplained < kSeemsUnexplained && fit_.power_factor > kSeemsPowerFactor &&
                    fit_.speed_m_per_s > kSeemsSpeed_m_per_s;
    if (unexplained >= std::min(kUnexplained, kUnexplainedPower * fit_.power_factor))
        return false;
    // Muscles that the fit does not know of make a force of so much of the whole, and in phase with
    // the motion no larger a power factor.
    const double muscles = std::sqrt(unexplained);
    const bool is_without_hand = fit_.power_factor > std::max(kPowerFactor, kOverMuscles * muscles);
    return fit_.least_power_factor > fit_.least_phase ||
           fit_.power_factor > std::max(kPowerFactor, fit_.held_phase) ||
           (is_without_hand && fit_.speed_m_per_s > kSeemsSpeed_m_per_s);
}

// False: too little is known yet.
bool SelfDriven::take_in(double passed_s) noexcept {
    uint32_t reach = 1;
    while (2 * reach < count_ && now_.time_s - back(reach).time_s < kReach_s * (1.0 - 1e-6))
        ++reach;
    if (2 * reach >= count_)
        return false;
    const std::array<double, 3> t{now_.time_s, back(reach).time_s, back(2 * reach).time_s};
    if (t[2] - std::max(lags_s_.front(), lags_s_.back()) < back(count_ - 1).time_s)
        return false;
    const std::array<glm::dvec3, 3> x{now_.position_m, back(reach).position_m,
                                      back(2 * reach).position_m};
    const glm::dvec3 velocity = (x[0] - x[2]) / (t[0] - t[2]);
    const double speed = glm::length(velocity);
    turns_.see(velocity, kSpeed_m_per_s, clock_s_);
    small_turns_.see(velocity, kSmallSpeed_m_per_s, clock_s_);

    const std::array<glm::dvec3, kTerms> terms{bend(x, t), velocity,
                                               velocity / std::max(speed, kSpeed_m_per_s),
                                               0.25 * (x[0] + 2.0 * x[1] + x[2])};
    const double keep = std::exp(-passed_s / kForget_s);
    weight_ = keep * weight_ + passed_s;
    for (uint32_t i = 0; i < kTerms; ++i) {
        terms_[i] = keep * terms_[i] + passed_s * terms[i];
        for (uint32_t k = 0; k <= i; ++k)
            products_[i][k] = keep * products_[i][k] + passed_s * glm::dot(terms[i], terms[k]);
    }
    for (uint32_t i = 0; i < kLags; ++i) {
        const double lag_s = lags_s_[i];
        const glm::dvec3 force =
            bend({twice_at(t[0] - lag_s), twice_at(t[1] - lag_s), twice_at(t[2] - lag_s)}, t);
        Lag& lag = of_lag_[i];
        lag.force = keep * lag.force + passed_s * force;
        lag.square = keep * lag.square + passed_s * glm::dot(force, force);
        for (uint32_t k = 0; k < kTerms; ++k)
            lag.products[k] = keep * lag.products[k] + passed_s * glm::dot(terms[k], force);
    }
    return true;
}

SelfDriven::Turns::Turns() noexcept {
    times_s.fill(-kTurns_s);
}

void SelfDriven::Turns::see(glm::dvec3 velocity_m_per_s, double least_m_per_s,
                            double clock_s) noexcept {
    const double speed = glm::length(velocity_m_per_s);
    if (speed < least_m_per_s)
        return;
    const bool turns = glm::dot(velocity_m_per_s, swing_m_per_s) < 0.0;
    if (turns) {
        std::copy_backward(times_s.begin(), times_s.end() - 1, times_s.end());
        times_s.front() = clock_s;
    }
    if (turns || speed > glm::length(swing_m_per_s))
        swing_m_per_s = velocity_m_per_s;
}

bool SelfDriven::Turns::are_often(double clock_s) const noexcept {
    return clock_s - times_s.back() <= kTurns_s;
}

void SelfDriven::solve(double tick_s) noexcept {
    // About means, and in units of each term's spread.
    Matrix<kTerms> covariance{};
    std::array<double, kTerms> spread{};
    for (uint32_t i = 0; i < kTerms; ++i)
        for (uint32_t k = 0; k <= i; ++k)
            covariance[i][k] = products_[i][k] - glm::dot(terms_[i], terms_[k]) / weight_;
    for (uint32_t i = 0; i < kTerms; ++i)
        spread[i] = std::sqrt(std::max(covariance[i][i], 1e-30));
    for (uint32_t i = 0; i < kTerms; ++i) {
        for (uint32_t k = 0; k <= i; ++k)
            covariance[i][k] /= spread[i] * spread[k];
        covariance[i][i] += 1e-9;
    }
    decompose(covariance);
    fit_ = {};
    const double better = better_at(tick_s);
    double left = 1.0; // of the best
    std::array<double, kLags> lefts{}, powers{};
    for (uint32_t i = 0; i < kLags; ++i) {
        const Lag& lag = of_lag_[i];
        const double variance = lag.square - glm::dot(lag.force, lag.force) / weight_;
        std::array<double, kTerms> with{};
        for (uint32_t k = 0; k < kTerms; ++k)
            with[k] = (lag.products[k] - glm::dot(terms_[k], lag.force) / weight_) / spread[k];
        // The stiffness comes last: where it would be negative, the fit goes without it.
        const std::array<double, kTerms> shares = forward(covariance, with);
        uint32_t count = kTerms;
        std::array<double, kTerms> found = backward(covariance, shares, count);
        if (found.back() < 0.0)
            found = backward(covariance, shares, --count);
        double explained = 0.0;
        for (uint32_t k = 0; k < count; ++k)
            explained += shares[k] * shares[k];
        explained = variance > 1e-12 ? std::clamp(explained / variance, 0.0, 1.0) : 0.0;
        const double mass = found[0] / spread[0], stiffness = found[3] / spread[3];
        // The hand takes up this power by the fit: unlike f . x' it does not waver within a cycle.
        const double power =
            found[1] / spread[1] * products_[1][1] + found[2] / spread[2] * products_[2][1];
        const double both = variance * products_[1][1];
        powers[i] = both > 0.0 ? power / std::sqrt(both) : 0.0;
        lefts[i] = 1.0 - explained;
        if (i > 0 && (1.0 - explained > left || mass <= 0.0))
            continue;
        left = i == 0 ? better * (1.0 - explained) : 1.0 - explained;
        fit_ = {.delay_s = lags_s_[i],
                .explained = explained,
                .power_factor = powers[i],
                .work_j = power,
                .force_n = std::sqrt(variance / weight_),
                .speed_m_per_s = std::sqrt(products_[1][1] / weight_),
                .mass_kg = mass,
                .stiffness_n_per_m = stiffness};
    }
    // The true delay may lie half a step from one that was tried, by which the force leaves about
    // the square of that phase. A held force is late by half a tick, too, whoever makes the motion.
    const double turn_per_s = std::sqrt(products_[1][1]) / spread[3];
    const double phase = 0.5 * kLag_s * turn_per_s;
    fit_.held_phase = 0.5 * tick_s * turn_per_s;
    fit_.least_phase = phase + fit_.held_phase;
    const double most_left = std::max(1.0 - fit_.explained, phase * phase) / better;
    fit_.least_power_factor = fit_.power_factor;
    for (uint32_t i = 0; i < kLags; ++i)
        if (lefts[i] <= most_left)
            fit_.least_power_factor = std::min(fit_.least_power_factor, powers[i]);
}

} // namespace palpate::haptics
