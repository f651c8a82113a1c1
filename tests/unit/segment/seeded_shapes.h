#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "engine/segment/methods.h"
#include "engine/volume/builder.h"
#include "engine/volume/grid.h"
#include "engine/volume/synthetic.h"

// Objects of which every sample is known, in values drawn at random, and seeds anywhere within
// them.
namespace palpate::seeded {

enum class Shape { ball, ellipsoid, shell };

// Distance to the shape's surface, or less than it, in mm; negative inside.
inline double depth(Shape shape, glm::dvec3 p, double size_mm) {
    switch (shape) {
        case Shape::ball:
            return glm::length(p) - size_mm;
        case Shape::ellipsoid:
            return (glm::length(p / (size_mm * glm::dvec3(1.3, 0.8, 0.6))) - 1.0) * 0.6 * size_mm;
        case Shape::shell:
            break;
    }
    return std::abs(glm::length(p) - 0.95 * size_mm) - 0.25 * size_mm;
}

struct Case {
    Volume volume, truth; // truth: u8, 1 inside
    std::vector<SeedBall> balls;
    Volume seeds;
};

// noise: standard deviation as a share of the contrast. radius_mm: of the one ball of seeds, whose
// central sample lies inside; below 0: of up to 4 x 4 samples in one plane, as a map. blur:
// standard deviation of the edge in the smallest spacing.
inline Case make_case(Shape shape, double size_mm, glm::dvec3 spacing, double noise,
                      double radius_mm, uint32_t seed, double blur = 0.0) {
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
        return low + (high - low) * double(random()) / 4294967296.0;
    };
    const glm::uvec3 size(glm::ceil(glm::dvec3(3.0 * size_mm) / spacing));
    const Grid grid = make_grid(size, spacing, -0.5 * spacing * (glm::dvec3(size) - 1.0));
    const glm::dvec3 middle(between(-1, 1), between(-1, 1), between(-1, 1));
    const auto depth_at = [&](glm::uvec3 i) {
        return depth(shape, world_point(grid, glm::dvec3(i)) - middle, size_mm);
    };
    const auto is_in = [&](glm::uvec3 i) { return depth_at(i) < 0.0; };
    const double blur_mm = blur * std::min({spacing.x, spacing.y, spacing.z});
    const auto outside = [&](glm::uvec3 i) {
        return blur > 0.0 ? 0.5 * std::erfc(-depth_at(i) / (std::sqrt(2.0) * blur_mm))
                          : double(!is_in(i));
    };
    // Contrasts of 1 to 3000 of either sign, on any offset.
    const double inside = between(-1000, 1000);
    const double contrast = (random() % 2 ? 1.0 : -1.0) * std::exp(between(0.0, std::log(3000.0)));
    const uint64_t noise_seed = random();
    Case made{make_volume(grid, ScalarType::f32,
                          [&](glm::uvec3 i) {
                              return inside + contrast * (outside(i) +
                                                          noise * synthetic::noise(i, noise_seed));
                          }),
              make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) { return is_in(i) ? 1.0 : 0.0; }),
              {},
              make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; })};
    glm::dvec3 at;
    glm::uvec3 sample;
    do {
        at = middle +
             size_mm * glm::dvec3(between(-1.3, 1.3), between(-1.3, 1.3), between(-1.3, 1.3));
        sample = glm::uvec3(glm::round(index_point(grid, at)));
    } while (!(depth(shape, at - middle, size_mm) < 0.0) || !is_in(sample));
    if (radius_mm >= 0.0) {
        made.balls = {{1, at, radius_mm}};
        made.seeds = *seed_map(made.volume, made.balls);
    } else {
        made.seeds = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
            const glm::ivec3 off = glm::ivec3(i) - glm::ivec3(sample);
            return off.z == 0 && off.x >= -1 && off.x < 3 && off.y >= -1 && off.y < 3 && is_in(i)
                       ? 1.0
                       : 0.0;
        });
    }
    return made;
}

inline double dice(const Volume& labels, const Volume& truth) {
    double both = 0.0, sum = 0.0;
    const glm::uvec3 n = truth.size();
    for (uint32_t z = 0; z < n.z; ++z)
        for (uint32_t y = 0; y < n.y; ++y)
            for (uint32_t x = 0; x < n.x; ++x) {
                const bool found = labels.value({x, y, z}) == 1.0f;
                const bool wanted = truth.value({x, y, z}) == 1.0f;
                both += found && wanted, sum += double(found) + double(wanted);
            }
    return 2.0 * both / sum;
}

// The worst Dice of `count` seeds a shape, spacing and kind of seed; asserts each one.
inline void expect_found(const char* method, double noise, uint32_t count, double size_mm,
                         double least, double blur = 0.0) {
    const SegmentMethod& by = *find_segment_method(method);
    uint32_t seed = 1;
    for (const Shape shape : {Shape::ball, Shape::ellipsoid, Shape::shell})
        for (const glm::dvec3 spacing : {glm::dvec3(1.0), glm::dvec3(0.7, 0.9, 1.6)})
            for (const double radius : {0.0, 1.0, 3.0, -1.0})
                for (uint32_t i = 0; i < count; ++i, ++seed) {
                    const Case one = make_case(shape, size_mm, spacing, noise, radius, seed, blur);
                    const Result<Segmented> made =
                        segment(by, {one.volume, one.seeds, one.balls, 0}, {}, {});
                    ASSERT_TRUE(made) << made.error().message << " seed " << seed;
                    ASSERT_GE(dice(made->labels, one.truth), least)
                        << method << ", shape " << int(shape) << ", spacing " << spacing.z
                        << ", seeds of " << radius << " mm, case " << seed;
                }
}

} // namespace palpate::seeded
