#include <algorithm>

#include "engine/volume/synthetic.h"

namespace palpate::synthetic {

namespace {

// A value and its gradient, carried together through the construction.
struct Jet {
    double value;
    glm::dvec3 gradient;
};

// 0 outside, 1 inside, a polynomial of degree five over a width of 1.5 mm about `distance` = 0
// (positive inside): two continuous derivatives and no call of the C library.
Jet inside_of(Jet distance) {
    constexpr double width_mm = 1.5;
    const double t = std::clamp(distance.value / width_mm + 0.5, 0.0, 1.0);
    const double slope = 30.0 * t * t * (t - 1.0) * (t - 1.0) / width_mm;
    return {t * t * t * (10.0 + t * (6.0 * t - 15.0)), slope * distance.gradient};
}

Jet blend(Jet under, double over, Jet share) {
    return {under.value + (over - under.value) * share.value,
            under.gradient * (1.0 - share.value) + (over - under.value) * share.gradient};
}

// (1 - |p / axes|) * scale: the distance to an ellipsoid along its smallest axis.
Jet ellipsoid(glm::dvec3 p, glm::dvec3 axes) {
    const double scale = std::min({axes.x, axes.y, axes.z});
    const double r = glm::length(p / axes);
    return {(1.0 - r) * scale, r > 0.0 ? p / (axes * axes) * (-scale / r) : glm::dvec3(0.0)};
}

Jet tube(glm::dvec3 p, glm::dvec3 from, glm::dvec3 to, double radius) {
    const glm::dvec3 along = to - from;
    const double t = std::clamp(glm::dot(p - from, along) / glm::dot(along, along), 0.0, 1.0);
    const glm::dvec3 away = p - (from + t * along);
    const double r = glm::length(away);
    return {radius - r, r > 0.0 ? away / -r : glm::dvec3(0.0)};
}

// Whether p is within reach of the edge of a tube of this radius round what lies in [low, high].
bool is_near(glm::dvec3 p, glm::dvec3 low, glm::dvec3 high, double radius) {
    const glm::dvec3 reach(radius + 1.0); // edges end 0.75 mm outside
    return glm::all(glm::greaterThan(p, low - reach)) && glm::all(glm::lessThan(p, high + reach));
}

// Parts whose share at p is 0 change no bit, and are left out: large phantoms are mostly air.
Jet phantom(glm::dvec3 p) {
    constexpr double air = -1000.0, scalp = 40.0, bone = 1100.0, brain = 35.0, vessel = 320.0;
    static const Field ring = torus({0.0, -10.0, -15.0}, 18.0, 1.5);
    const glm::dvec3 head(75.0, 95.0, 85.0);
    Jet hu{air, {}};
    const Jet in_head = inside_of(ellipsoid(p, head));
    if (in_head.value == 0.0) // all else lies within
        return hu;
    hu = blend(hu, scalp, in_head);
    hu = blend(hu, bone, inside_of(ellipsoid(p, 0.94 * head)));
    hu = blend(hu, brain, inside_of(ellipsoid(p, 0.88 * head)));
    const auto add_tube = [&](glm::dvec3 from, glm::dvec3 to, double radius) {
        if (is_near(p, glm::min(from, to), glm::max(from, to), radius))
            hu = blend(hu, vessel, inside_of(tube(p, from, to, radius)));
    };
    add_tube({10.0, 20.0, -60.0}, {10.0, 20.0, 55.0}, 3.0);
    add_tube({-40.0, -30.0, -20.0}, {-15.0, 35.0, 45.0}, 2.0);
    if (is_near(p, {-18.0, -28.0, -15.0}, {18.0, 8.0, -15.0}, 1.5))
        hu = blend(hu, vessel, inside_of({ring.value(p), ring.gradient(p)}));
    return hu;
}

} // namespace

Field ct_phantom() {
    return {[](glm::dvec3 p) { return phantom(p).value; },
            [](glm::dvec3 p) { return phantom(p).gradient; }};
}

Volume sample_ct_phantom(const Grid& grid, uint64_t seed) {
    return sample(ct_phantom(), grid, ScalarType::i16, kCtNoise_hu, seed);
}

} // namespace palpate::synthetic
