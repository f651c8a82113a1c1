#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/proxy/swept_mesh.h"
#include "haptics/proxy/yielding.h"

// A hand that slides under a surface through a band of samples without data,
// and back: the force fades there and comes again, by the rate of edits.
namespace palpate::haptics {

struct GapCase {
    const char* algorithm = "swept-point";
    TouchSource source = TouchSource::grey;
    double value = std::numeric_limits<double>::quiet_NaN(); // of the band: NaN or infinite
    double tilt = 90.0;    // degrees between the band's normal and the surface's
    double azimuth = 0.0;  // degrees between the band's normal and the hand's way,
                           // on the surface
    double width_mm = 2.0; // of the band
    double radius_mm = 0.0, hertz = 1000.0;
    double yield_n = 0.0;
    uint64_t seed = 0;
};

inline std::string name_of(const GapCase& c) {
    return std::string(c.algorithm) + (c.source == TouchSource::labels ? ", labels" : ", grey") +
           ", band of " + std::to_string(c.value) + ", tilt " + std::to_string(c.tilt) +
           ", azimuth " + std::to_string(c.azimuth) + ", " + std::to_string(c.width_mm) +
           " mm, radius " + std::to_string(c.radius_mm) + ", " + std::to_string(c.hertz) +
           " Hz, T0 " + std::to_string(c.yield_n) + ", seed " + std::to_string(c.seed);
}

struct Crossed {
    // The change of force from tick to tick, beyond what the spring makes of the hand's motion and
    // the rate; and the same next to ticks that are unknown.
    double most_change_n = 0.0, most_change_at_gap_n = 0.0;
    double most_left_n = 0.0; // force in the band, beyond what the rate leaves of it there
    double pressed_n = 0.0;   // on sound data before, as a share of what the spring makes
    double again_n = 0.0;     // the same after
    int unknown = 0, ticks = 0;
    bool is_finite = true;

    // Expected of a repaired algorithm. Labels are steps of half a sample, over which a force may
    // change by what an edit may; a gap adds nothing to that.
    bool is_gentle(TouchSource source) const {
        return most_change_n <= (source == TouchSource::labels ? 0.1 : 0.02) &&
               most_change_at_gap_n <= 0.02;
    }
};

inline Crossed cross(const GapCase& c) {
    std::mt19937_64 random(c.seed * 7919 + 5);
    const auto within = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const glm::dvec3 n = glm::normalize(glm::dvec3(within(-1, 1), within(-1, 1), within(-1, 1)) +
                                        glm::dvec3(0.0, 0.0, 0.2));
    const glm::dvec3 along = glm::normalize(glm::cross(n, glm::dvec3(0.31, 0.52, 0.79)));
    const glm::dvec3 side = glm::cross(n, along);
    const double tilt = c.tilt * std::numbers::pi / 180.0,
                 azimuth = c.azimuth * std::numbers::pi / 180.0;
    const glm::dvec3 band = std::cos(tilt) * n +
                            std::sin(tilt) * (std::cos(azimuth) * along + std::sin(azimuth) * side);
    const double at_mm = within(-0.5, 0.5);
    constexpr double kSpacing_mm = 0.5, kHalf_mm = 11.75;
    const bool is_labels = c.source == TouchSource::labels;
    const auto gap_mm = [&](glm::dvec3 p) { // from the band's middle plane
        return std::abs(glm::dot(p, band) - at_mm);
    };
    const Grid grid = make_grid(glm::uvec3(48), glm::dvec3(kSpacing_mm), glm::dvec3(-kHalf_mm));
    const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        const glm::dvec3 p = glm::dvec3(i) * kSpacing_mm - kHalf_mm;
        const double d = glm::dot(p, n);
        return gap_mm(p) < 0.5 * c.width_mm ? c.value
               : is_labels                  ? (d < 0.0 ? 1.0 : 0.0)
                                            : 500.0 * std::erfc(d / (std::sqrt(2.0) * 0.35));
    });
    TouchParameters q{.iso = 500.0,
                      .tool_radius_mm = c.radius_mm,
                      .stiffness_n_per_m = within(500.0, 1500.0),
                      .yield_n = c.yield_n,
                      .source = c.source};
    q.transfer[0].strength_n = 2.0; // of motion rules
    q.normal_blur_samples = 0.6;
    q.edge_samples = 0.7;
    TouchScene scene{.version = 1};
    (is_labels ? scene.labels : scene.grey) = volume;
    if (std::string_view(c.algorithm) == "swept-mesh")
        scene.touch_mesh =
            make_touch_mesh(std::make_shared<const Mesh>(touch_surface(volume, q)), 0.25);
    const double k = 1e-3 * q.stiffness_n_per_m;
    const double depth_mm = within(0.6, 3.0),
                 speed = std::exp(within(std::log(20.0), std::log(300.0)));

    // In, along, and up; on to the far side, and in again by 1 mm.
    struct Leg {
        double to_along, to_height; // of the tool's lowest point
        double seconds;
    };
    constexpr double kFar_mm = 6.5, kUp_mm = 2.5;
    const Leg legs[] = {{-kFar_mm, -depth_mm, (kUp_mm + depth_mm) / speed},
                        {-kFar_mm, -depth_mm, 0.05},
                        {kFar_mm, -depth_mm, 2.0 * kFar_mm / speed},
                        {kFar_mm, -depth_mm, 0.05},
                        {0.3 * kFar_mm, -depth_mm, 0.7 * kFar_mm / speed},
                        {kFar_mm, kUp_mm, 1.3 * kFar_mm / speed},
                        {kFar_mm, -1.0, (kUp_mm + 1.0) / speed},
                        {kFar_mm, -1.0, 0.1}};
    constexpr size_t kLegs = std::size(legs);
    const std::unique_ptr<Algorithm> algorithm = find_algorithm(c.algorithm)->make();
    const double dt = 1.0 / c.hertz;
    Crossed crossed;
    glm::dvec3 last(0.0), last_n(0.0);
    bool was_unknown = false;
    double entered_n = -1.0, in_band_s = 0.0;
    double from_along = -kFar_mm, from_height = kUp_mm, t = 0.0;
    for (size_t leg = 0; leg < kLegs; ++leg) {
        const auto [to_along, to_height, seconds] = legs[leg];
        for (; t < seconds; t += dt) {
            const glm::dvec3 x = glm::mix(from_along, to_along, t / seconds) * along +
                                 (glm::mix(from_height, to_height, t / seconds) + c.radius_mm) * n;
            const bool is_first = crossed.ticks == 0;
            const TickInput input{.tool = {.position_mm = x},
                                  .velocity_mm_per_s = is_first ? glm::dvec3(0.0) : (x - last) / dt,
                                  .dt_s = dt,
                                  .scene = &scene,
                                  .parameters = &q};
            if (is_first)
                algorithm->reset(input);
            const TickOutput out = algorithm->tick(input);
            const double force = glm::length(out.force_n);
            const bool is_unknown = out.contact == Contact::unknown;
            crossed.is_finite = crossed.is_finite && std::isfinite(force) &&
                                std::isfinite(glm::length(out.proxy.position_mm));
            if (!is_first) {
                const double change = glm::distance(out.force_n, last_n) -
                                      k * glm::distance(x, last) - Yielding::kRate_n_per_s * dt;
                crossed.most_change_n = std::max(crossed.most_change_n, change);
                if (is_unknown || was_unknown)
                    crossed.most_change_at_gap_n = std::max(crossed.most_change_at_gap_n, change);
            }
            // If the surface under the hand is in the band, force is what the rate has
            // left.
            const bool in_band = gap_mm(x - glm::dot(x, n) * n) < 0.5 * c.width_mm - kSpacing_mm &&
                                 glm::dot(x, n) < c.radius_mm;
            in_band_s = in_band && entered_n >= 0.0 ? in_band_s + dt : 0.0;
            entered_n = in_band ? (entered_n < 0.0 ? glm::length(last_n) : entered_n) : -1.0;
            if (in_band)
                crossed.most_left_n = std::max(
                    crossed.most_left_n,
                    force - std::max(0.0, entered_n - Yielding::kRate_n_per_s * in_band_s));
            crossed.unknown += is_unknown;
            ++crossed.ticks;
            was_unknown = is_unknown;
            last = x;
            last_n = out.force_n;
        }
        t -= seconds;
        from_along = to_along;
        from_height = to_height;
        if (leg == 1)
            crossed.pressed_n = glm::length(last_n) / (k * depth_mm);
    }
    crossed.again_n = glm::length(last_n) / k;
    return crossed;
}

// The band lies away from where the hand presses before and after: what filters
// read of the volume does not reach it.
inline bool is_sound_at_ends(const GapCase& c) {
    const double off = std::abs(std::sin(c.tilt * std::numbers::pi / 180.0) *
                                std::cos(c.azimuth * std::numbers::pi / 180.0)) *
                       6.5;
    return off > 0.5 * c.width_mm + 0.5 + 4.0;
}

} // namespace palpate::haptics
