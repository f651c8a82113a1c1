#include "engine/segment/level_set_speed.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/derivatives.h"
#include "engine/segment/gaussian.h"
#include "engine/segment/map_values.h"
#include "engine/volume/box.h"
#include "engine/volume/extent.h"

namespace palpate {

Result<Volume> threshold_speed(const Volume& volume, const ValueInterval& interval,
                               const Task& task) {
    if (!std::isfinite(interval.low) || !std::isfinite(interval.high) ||
        !(interval.low < interval.high))
        return fail("expected values from a lower to a higher one, found {:g} .. {:g}",
                    interval.low, interval.high);
    const double half = 0.5 * (interval.high - interval.low), middle = interval.low + half;
    return map_values<float>(std::array{&volume}, task, [=](auto v) {
        return std::isnan(v[0]) ? v[0]
                                : float(std::max(-1.0, 1.0 - std::abs(v[0] - middle) / half));
    });
}

Result<Volume> edge_speed(const Volume& volume, const EdgeSpeedOptions& o, const Task& task) {
    if (!(o.edge > 0.0))
        return fail("edge: expected a number above 0, found {:g}", o.edge);
    PALPATE_TRY(const Volume slopes, gradient_magnitude(volume, {o.sigma_mm}, task.part(0.0, 0.9)));
    return map_values<float>(std::array{&slopes}, task.part(0.9, 1.0), [=](auto v) {
        return std::isnan(v[0]) ? v[0] : float(1.0 / (1.0 + std::pow(v[0] / o.edge, o.exponent)));
    });
}

namespace {

const std::array<glm::ivec3, 9> kUpToSecond{glm::ivec3{1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                                            {2, 0, 0},           {0, 2, 0}, {0, 0, 2},
                                            {1, 1, 0},           {1, 0, 1}, {0, 1, 1}};

enum class Edge { place, shift };

struct EdgePlace {
    Edge what;
    Derivatives derivatives;
    const Volume& distance;
    EdgeSpeedOptions options;
    glm::dmat3 world; // gradients by the index to those by mm
    double smallest_mm;

    BrickPtr brick(glm::uvec3 at) const {
        constexpr int kWide = int(kBrickSide) + 2;
        thread_local std::vector<std::vector<float>> d;
        thread_local std::vector<float> away(size_t{kWide} * kWide * kWide), made(kBrickSamples);
        const Brick& near = distance.brick(at);
        // Beyond two spacings distances are all the same.
        const bool has_surface = what == Edge::shift
                                     ? near.range().min < near.range().max
                                     : near.range().min < 0.0f && near.range().max > 0.0f;
        if (!has_surface || !derivatives.compute(at, kUpToSecond, d))
            return constant_brick(ScalarType::f32, 0.0f);
        read_box(distance, glm::ivec3(at * kBrickSide) - 1, glm::ivec3(kWide),
                 packed(glm::uvec3(kWide)), away.data());
        const glm::uvec3 valid = distance.valid_in_brick(at);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const size_t i = offset_in_brick({x, y, z});
                    const float* phi = &away[x + 1 + kWide * (y + 1 + size_t{kWide} * (z + 1))];
                    glm::dvec3 outward;
                    const int strides[] = {1, kWide, kWide * kWide};
                    for (int k = 0; k < 3; ++k) {
                        const double rise = double{phi[strides[k]]} - double{phi[-strides[k]]};
                        outward[k] = std::isnan(rise) ? 0.0 : rise;
                    }
                    made[i] = float(value(d, i, world * outward));
                }
        return Brick::make(std::span<const float>(made), valid);
    }

    double value(const std::vector<std::vector<float>>& d, size_t i, glm::dvec3 outward) const {
        const auto at = [&](size_t n) { return double{d[n][i]}; };
        const glm::dvec3 g = world * glm::dvec3(at(0), at(1), at(2));
        const double length = glm::length(g);
        if (!(length > 0.0)) // flat, or no data
            return length == 0.0 || what == Edge::shift ? 0.0 : double(NAN);
        const glm::dmat3 h(at(3), at(6), at(7), at(6), at(4), at(8), at(7), at(8), at(5));
        const glm::dmat3 hessian = world * h * glm::transpose(world);
        const double along = glm::dot(g, hessian * g) / (length * length);
        const double trace = hessian[0][0] + hessian[1][1] + hessian[2][2];
        const double slope = glm::dot(g, outward);
        const double side = slope > 0.0 ? 1.0 : slope < 0.0 ? -1.0 : 0.0;
        const double indicator = 1.0 / (1.0 + std::pow(length / options.edge, options.exponent));
        if (what == Edge::place)
            return side * std::clamp(2.0 * smallest_mm * along / length, -1.0, 1.0) *
                   (1.0 - indicator);
        const double out_mm =
            0.5 * options.sigma_mm * options.sigma_mm * side * (trace - along) / length;
        const double most_mm = 0.5 * options.sigma_mm;
        return indicator < 0.5 && std::isfinite(out_mm) ? std::clamp(out_mm, -most_mm, most_mm)
                                                        : 0.0;
    }
};

Result<Volume> about_edge(Edge what, const Volume& volume, const Volume& distance,
                          const EdgeSpeedOptions& options, const Task& task) {
    if (volume.size() != distance.size())
        return fail("expected a distance on the grid of the volume, found another grid");
    PALPATE_TRY(Derivatives::check(volume, options.sigma_mm));
    const EdgePlace place{what,
                          Derivatives(volume, options.sigma_mm),
                          distance,
                          options,
                          glm::transpose(glm::inverse(glm::dmat3(volume.grid().world_from_index))),
                          smallest_spacing_mm(volume.grid())};
    return make_bricks(volume.grid(), ScalarType::f32, task,
                       [&](glm::uvec3 at) { return place.brick(at); });
}

} // namespace

Result<Volume> edge_place_speed(const Volume& volume, const Volume& distance,
                                const EdgeSpeedOptions& options, const Task& task) {
    return about_edge(Edge::place, volume, distance, options, task);
}

Result<Volume> edge_shift_mm(const Volume& volume, const Volume& distance,
                             const EdgeSpeedOptions& options, const Task& task) {
    return about_edge(Edge::shift, volume, distance, options, task);
}

Result<Volume> region_speed(const Volume& volume, const SeedValues& inside,
                            const SeedValues& outside, const Task& task) {
    const double in = spread_of(inside, volume), out = spread_of(outside, volume);
    return map_values<float>(std::array{&volume}, task, [=](auto v) {
        if (std::isnan(v[0]))
            return v[0];
        const double a = (v[0] - inside.mean) / in, b = (v[0] - outside.mean) / out;
        // (p_in - p_out) / (p_in + p_out) without quotients of two numbers near 0.
        return float(std::tanh(0.5 * (0.5 * (b * b - a * a) + std::log(out / in))));
    });
}

} // namespace palpate
