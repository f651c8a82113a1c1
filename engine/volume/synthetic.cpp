#include "engine/volume/synthetic.h"

#include <cmath>
#include <numbers>

#include "engine/base/assert.h"
#include "engine/volume/builder.h"

namespace palpate::synthetic {

namespace {

constexpr double kPi = std::numbers::pi;

// Integral and density of the normal distribution.
double normal_cdf(double x, double sigma) {
    return 0.5 * (1.0 + std::erf(x / (sigma * std::numbers::sqrt2)));
}
double normal_density(double x, double sigma) {
    return std::exp(-0.5 * x * x / (sigma * sigma)) / (sigma * std::sqrt(2.0 * kPi));
}

glm::dvec3 direction_or_zero(glm::dvec3 v) {
    const double length = glm::length(v);
    return length > 0.0 ? v / length : glm::dvec3(0.0);
}

} // namespace

Field ramp(glm::dvec3 slope, double offset) {
    return {[=](glm::dvec3 p) { return offset + glm::dot(slope, p); },
            [=](glm::dvec3) { return slope; }};
}

Field slab(glm::dvec3 center, glm::dvec3 normal, double thickness, double sigma, double inside,
           double outside) {
    PALPATE_ASSERT(sigma > 0.0 && glm::length(normal) > 0.0);
    const glm::dvec3 n = glm::normalize(normal);
    const double half = 0.5 * thickness;
    return {[=](glm::dvec3 p) {
                const double d = glm::dot(n, p - center);
                const double share = normal_cdf(d + half, sigma) - normal_cdf(d - half, sigma);
                return outside + (inside - outside) * share;
            },
            [=](glm::dvec3 p) {
                const double d = glm::dot(n, p - center);
                return n * ((inside - outside) *
                            (normal_density(d + half, sigma) - normal_density(d - half, sigma)));
            }};
}

Field sphere_distance(glm::dvec3 center, double radius) {
    return {[=](glm::dvec3 p) { return radius - glm::length(p - center); },
            [=](glm::dvec3 p) { return -direction_or_zero(p - center); }};
}

Field sphere(glm::dvec3 center, double radius, double sigma, double inside, double outside) {
    PALPATE_ASSERT(sigma > 0.0);
    return {[=](glm::dvec3 p) {
                return outside +
                       (inside - outside) * normal_cdf(radius - glm::length(p - center), sigma);
            },
            [=](glm::dvec3 p) {
                const double density = normal_density(radius - glm::length(p - center), sigma);
                return direction_or_zero(p - center) * ((outside - inside) * density);
            }};
}

Field torus(glm::dvec3 center, double ring, double tube) {
    return {[=](glm::dvec3 p) {
                const glm::dvec3 v = p - center;
                return tube - glm::length(glm::dvec2(glm::length(glm::dvec2(v)) - ring, v.z));
            },
            [=](glm::dvec3 p) {
                const glm::dvec3 v = p - center;
                const glm::dvec3 radial = direction_or_zero({v.x, v.y, 0.0});
                return -direction_or_zero(radial * (glm::length(glm::dvec2(v)) - ring) +
                                          glm::dvec3(0.0, 0.0, v.z));
            }};
}

Field gyroid(double period) {
    const double k = 2.0 * kPi / period;
    return {[=](glm::dvec3 p) {
                const glm::dvec3 s = glm::sin(k * p), c = glm::cos(k * p);
                return s.x * c.y + s.y * c.z + s.z * c.x;
            },
            [=](glm::dvec3 p) {
                const glm::dvec3 s = glm::sin(k * p), c = glm::cos(k * p);
                return k * glm::dvec3(c.x * c.y - s.z * s.x, c.y * c.z - s.x * s.y,
                                      c.z * c.x - s.y * s.z);
            }};
}

Field gaussian(glm::dvec3 center, double sigma, double peak) {
    const auto value = [=](glm::dvec3 p) {
        return peak * std::exp(-0.5 * glm::dot(p - center, p - center) / (sigma * sigma));
    };
    return {value, [=](glm::dvec3 p) { return (center - p) * (value(p) / (sigma * sigma)); }};
}

Field marschner_lobb(double half_side) {
    constexpr double frequency = 6.0, alpha = 0.25;
    constexpr double scale = 1.0 / (2.0 * (1.0 + alpha));
    return {[=](glm::dvec3 p) {
                const glm::dvec3 u = p / half_side;
                const double r = glm::length(glm::dvec2(u));
                const double wave = std::cos(2.0 * kPi * frequency * std::cos(0.5 * kPi * r));
                return scale * (1.0 - std::sin(0.5 * kPi * u.z) + alpha * (1.0 + wave));
            },
            [=](glm::dvec3 p) {
                const glm::dvec3 u = p / half_side;
                const double r = glm::length(glm::dvec2(u));
                const double phase = 2.0 * kPi * frequency * std::cos(0.5 * kPi * r);
                const double slope =
                    std::sin(phase) * kPi * kPi * frequency * std::sin(0.5 * kPi * r);
                const glm::dvec3 radial = direction_or_zero({u.x, u.y, 0.0});
                const glm::dvec3 axial(0.0, 0.0, -0.5 * kPi * std::cos(0.5 * kPi * u.z));
                return (axial + radial * (alpha * slope)) * (scale / half_side);
            }};
}

Field shells(glm::dvec3 center, double period) {
    const double k = 2.0 * kPi / period;
    return {[=](glm::dvec3 p) { return 0.5 * (1.0 + std::cos(k * glm::length(p - center))); },
            [=](glm::dvec3 p) {
                const double slope = -0.5 * k * std::sin(k * glm::length(p - center));
                return direction_or_zero(p - center) * slope;
            }};
}

Field thin_sheet(glm::dvec3 point, glm::dvec3 normal, double sigma, double peak) {
    PALPATE_ASSERT(sigma > 0.0 && glm::length(normal) > 0.0);
    const glm::dvec3 n = glm::normalize(normal);
    const auto at_distance = [=](double d) {
        return peak * std::exp(-0.5 * d * d / (sigma * sigma));
    };
    return {[=](glm::dvec3 p) { return at_distance(glm::dot(n, p - point)); },
            [=](glm::dvec3 p) {
                const double d = glm::dot(n, p - point);
                return n * (-d / (sigma * sigma) * at_distance(d));
            }};
}

Field checkerboard(double cell, uint32_t count) {
    PALPATE_ASSERT(cell > 0.0 && count >= 2);
    return {[=](glm::dvec3 p) {
                const glm::dvec3 c = glm::floor(p / cell);
                const double sum = c.x + c.y + c.z;
                return sum - count * std::floor(sum / count);
            },
            [](glm::dvec3) { return glm::dvec3(0.0); }};
}

double noise(glm::uvec3 index, uint64_t seed) {
    // Twelve 16-bit numbers out of three words of splitmix64 (Steele, Lea & Flood 2014). Their sum
    // has mean 12 * 32767.5 and, but for a part in 2^32, the variance of 2^16 squared.
    uint64_t state = seed * 0x9e3779b97f4a7c15u;
    const auto mix = [&](uint64_t word) {
        state = (state ^ word) + 0x9e3779b97f4a7c15u;
        uint64_t z = state;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
        z = (z ^ z >> 27) * 0x94d049bb133111ebu;
        return state = z ^ z >> 31;
    };
    mix(index.x | uint64_t{index.y} << 32);
    uint32_t sum = 0;
    for (uint64_t word : {mix(index.z), mix(1), mix(2)})
        for (int part = 0; part < 4; ++part, word >>= 16)
            sum += static_cast<uint32_t>(word & 0xffff);
    return (static_cast<double>(sum) - 12.0 * 32767.5) / 65536.0;
}

Volume sample(const Field& field, const Grid& grid, ScalarType type, double noise_sigma,
              uint64_t seed) {
    return make_volume(grid, type, [&](glm::uvec3 index) {
        const double value = field.value(world_point(grid, glm::dvec3(index)));
        return noise_sigma > 0.0 ? value + noise_sigma * noise(index, seed) : value;
    });
}

} // namespace palpate::synthetic
