#include "haptics/device/wooden/kinematics.h"

#include <cmath>
#include <numbers>

namespace palpate::haptics::wooden {

namespace {

// Towards the person, right, up: the makers' order; ours is right, up, towards the person.
glm::dvec3 ours(glm::dvec3 theirs) {
    return {theirs.y, theirs.z, theirs.x};
}
glm::dvec3 theirs(glm::dvec3 ours) {
    return {ours.z, ours.x, ours.y};
}

} // namespace

const Geometry kWoodenHaptics{.name = "WoodenHaptics",
                              .post_m = 0.080,
                              .upper_m = 0.205,
                              .lower_m = 0.245,
                              .ratio = {-0.010 / 0.160, -0.010 / 0.120, 0.010 / 0.120},
                              .middle_m = {0.220, 0.0, 0.080},
                              .max_stiffness_n_per_m = 1000.0};
const Geometry kPolhem{.name = "Polhem",
                       .post_m = 0.058,
                       .upper_m = 0.174,
                       .lower_m = 0.133,
                       .ratio = {-0.010 / 0.180, -0.010 / 0.100, 0.010 / 0.100},
                       .middle_m = {0.140, 0.0, 0.100},
                       .max_stiffness_n_per_m = 800.0};

Angles angles_of(const Geometry& g, const Counts& counts) noexcept {
    Angles angles;
    for (size_t i = 0; i < 3; ++i)
        angles[i] = g.ratio[i] * 2.0 * std::numbers::pi * counts[i] / g.counts_per_turn;
    return angles;
}

std::optional<std::array<int16_t, 3>> counts_of(const Geometry& g, const Angles& angles) noexcept {
    std::array<int16_t, 3> counts{};
    for (size_t i = 0; i < 3; ++i) {
        const double exact =
            std::round(angles[i] / g.ratio[i] * g.counts_per_turn / (2.0 * std::numbers::pi));
        if (!(std::abs(exact) <= 32767.0))
            return std::nullopt;
        counts[i] = static_cast<int16_t>(exact);
    }
    return counts;
}

glm::dvec3 forward(const Geometry& g, const Angles& angles) noexcept {
    const auto [a, b, c] = angles;
    const double out = g.upper_m * std::sin(b) + g.lower_m * std::sin(c);
    const double up = g.post_m + g.upper_m * std::cos(b) - g.lower_m * std::cos(c);
    return ours(glm::dvec3(std::cos(a) * out, std::sin(a) * out, up) - g.middle_m);
}

std::optional<Angles> inverse(const Geometry& g, glm::dvec3 position_m) noexcept {
    const glm::dvec3 place = theirs(position_m) + g.middle_m;
    const double out = std::hypot(place.x, place.y), up = place.z - g.post_m;
    const double reach = std::hypot(out, up);
    if (!(out > 1e-6) || !(reach < g.upper_m + g.lower_m) ||
        !(reach > std::abs(g.upper_m - g.lower_m)))
        return std::nullopt;
    // Angles from the vertical; the triangle of the two links and the line to the grip.
    const double line = std::atan2(out, up);
    const double at_post = std::acos(
        (g.upper_m * g.upper_m + reach * reach - g.lower_m * g.lower_m) / (2 * g.upper_m * reach));
    const double b = line - at_post;
    const double c = std::atan2(out - g.upper_m * std::sin(b), g.upper_m * std::cos(b) - up);
    return Angles{std::atan2(place.y, place.x), b, c};
}

glm::dmat3 jacobian(const Geometry& g, const Angles& angles) noexcept {
    const auto [a, b, c] = angles;
    const double out = g.upper_m * std::sin(b) + g.lower_m * std::sin(c);
    const double by_b = g.upper_m * std::cos(b), by_c = g.lower_m * std::cos(c);
    return {ours({-std::sin(a) * out, std::cos(a) * out, 0.0}),
            ours({std::cos(a) * by_b, std::sin(a) * by_b, -g.upper_m * std::sin(b)}),
            ours({std::cos(a) * by_c, std::sin(a) * by_c, g.lower_m * std::sin(c)})};
}

glm::dvec3 currents(const Geometry& g, const Angles& angles, glm::dvec3 force_n) noexcept {
    const glm::dvec3 torque_nm = glm::transpose(jacobian(g, angles)) * force_n; // of the bodies
    return torque_nm * glm::dvec3(g.ratio[0], g.ratio[1], g.ratio[2]) / g.torque_nm_per_a;
}

} // namespace palpate::haptics::wooden
