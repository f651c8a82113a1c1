#include "haptics/device/falcon/kinematics.h"

#include <cmath>
#include <numbers>

namespace palpate::haptics::falcon {

namespace {

constexpr double kArm_m = 0.060, kForearm_m = 0.1025, kOffset_m = 0.01443, kEnds_m = 2 * 0.01125,
                 kSide_m = -0.025, kBase_m = 0.040, kShift_m = -0.02309; // a, b, c, d + e, f, r, s
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kArmZero = 35.0 * kDegree;
// 320 slots of 4 edges a turn of a motor, whose shaft of 14.25 mm drives a drum of 110 mm.
constexpr double kCount = 2.0 * std::numbers::pi / 1280.0 * 14.25 / 110.0;

struct LegAxes {
    double cosine, sine;
};
const std::array<LegAxes, 3> kLegs = [] {
    std::array<LegAxes, 3> legs{};
    for (size_t leg = 0; leg < 3; ++leg) {
        const double azimuth = (105.0 - 120.0 * static_cast<double>(leg)) * kDegree;
        legs[leg] = {std::cos(azimuth), std::sin(azimuth)};
    }
    return legs;
}();

// The grip as a leg sees it: along the arm's plane from its motor (u, with the offset of the grip's
// end), across it (v) and up (w); and the reach of the forearm in the arm's plane.
struct Seen {
    double u, v, w;
    double across_m; // b in that plane; not a number beyond its length
    double reach() const { return kEnds_m + across_m; }
};

Seen seen_by(const LegAxes& leg, glm::dvec3 p) {
    Seen seen{.u = leg.cosine * p.x + leg.sine * p.y - kBase_m + kOffset_m,
              .v = -leg.sine * p.x + leg.cosine * p.y - kShift_m + kSide_m,
              .w = p.z,
              .across_m = 0.0};
    seen.across_m = std::sqrt(kForearm_m * kForearm_m - seen.v * seen.v);
    return seen;
}

double square(double x) {
    return x * x;
}

} // namespace

double angle_of_count(int count) noexcept {
    return kArmZero + kCount * count;
}

double count_of_angle(double angle) noexcept {
    return (angle - kArmZero) / kCount;
}

glm::dvec3 loop_error(const Angles& angles, glm::dvec3 position_m) noexcept {
    glm::dvec3 error;
    for (int leg = 0; leg < 3; ++leg) {
        const auto at = static_cast<size_t>(leg);
        const Seen seen = seen_by(kLegs[at], position_m);
        error[leg] = square(seen.u - kArm_m * std::cos(angles[at])) +
                     square(seen.w - kArm_m * std::sin(angles[at])) - square(seen.reach());
    }
    return error;
}

LoopGradient loop_gradient(const Angles& angles, glm::dvec3 position_m) noexcept {
    LoopGradient gradient;
    for (int leg = 0; leg < 3; ++leg) {
        const auto at = static_cast<size_t>(leg);
        const LegAxes& axes = kLegs[at];
        const Seen seen = seen_by(axes, position_m);
        const double cosine = std::cos(angles[at]), sine = std::sin(angles[at]);
        const double by_u = 2.0 * (seen.u - kArm_m * cosine), by_w = 2.0 * (seen.w - kArm_m * sine),
                     by_v = 2.0 * seen.reach() * seen.v / seen.across_m;
        gradient.by_position[0][leg] = by_u * axes.cosine - by_v * axes.sine;
        gradient.by_position[1][leg] = by_u * axes.sine + by_v * axes.cosine;
        gradient.by_position[2][leg] = by_w;
        gradient.by_angle[leg] = 2.0 * kArm_m * (seen.u * sine - seen.w * cosine);
    }
    return gradient;
}

std::optional<glm::dvec3> forward(const Angles& angles, glm::dvec3 start_m) noexcept {
    constexpr int kMostSteps = 20;
    constexpr double kMostStep_m = 0.05; // beyond it the legs' equations are far from straight
    glm::dvec3 position = start_m;
    for (int step = 0; step < kMostSteps; ++step) {
        const glm::dmat3 by_position = loop_gradient(angles, position).by_position;
        const double determinant = glm::determinant(by_position);
        if (!(std::abs(determinant) > 1e-9)) // of lengths of about 0.1 m: 1e-3 where all is well
            return std::nullopt;
        glm::dvec3 move = glm::inverse(by_position) * loop_error(angles, position);
        const double length = glm::length(move);
        if (!std::isfinite(length))
            return std::nullopt;
        if (length > kMostStep_m)
            move *= kMostStep_m / length;
        position -= move;
        if (length < 1e-12)
            return position.z > 0.0 ? std::optional(position) : std::nullopt;
    }
    return std::nullopt;
}

std::optional<Angles> inverse(glm::dvec3 position_m) noexcept {
    Angles angles{};
    for (size_t leg = 0; leg < 3; ++leg) {
        // u cos(angle) + w sin(angle) = k, by the tangent of half the angle.
        const Seen seen = seen_by(kLegs[leg], position_m);
        const double k = (square(seen.u) + square(seen.w) + square(kArm_m) - square(seen.reach())) /
                         (2.0 * kArm_m);
        const double root = square(seen.u) + square(seen.w) - square(k);
        if (!(root >= 0.0))
            return std::nullopt;
        angles[leg] = std::remainder(2.0 * std::atan2(seen.w - std::sqrt(root), k + seen.u),
                                     2.0 * std::numbers::pi);
    }
    return angles;
}

std::optional<glm::dmat3> jacobian(const Angles& angles, glm::dvec3 position_m) noexcept {
    const LoopGradient gradient = loop_gradient(angles, position_m);
    if (!(std::abs(glm::determinant(gradient.by_position)) > 1e-9))
        return std::nullopt;
    glm::dmat3 by_angle(0.0);
    for (int leg = 0; leg < 3; ++leg)
        by_angle[leg][leg] = gradient.by_angle[leg];
    return -glm::inverse(gradient.by_position) * by_angle;
}

} // namespace palpate::haptics::falcon
